#pragma once

#include <numbers>

namespace saccade {

/// One degree [rad].
inline constexpr double kDegree = std::numbers::pi / 180.0;

}  // namespace saccade
