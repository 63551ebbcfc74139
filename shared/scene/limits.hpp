#pragma once

#include <cstddef>

namespace saccade {

// What callers may give of an annotation. The wire checks it where it arrives, with the field's
// name; who places and keeps it does so again, whoever asked.
inline constexpr double kMaxCoordinateM = 1e4;  // of each coordinate of a point in world [m]
inline constexpr double kMaxSizeM = 10.0;
inline constexpr std::size_t kMaxTextBytes = 500;
inline constexpr std::size_t kMaxInkPoints = 2000;

}  // namespace saccade
