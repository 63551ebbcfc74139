#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "server/eval/commands.hpp"

namespace saccade {

/// Monte-Carlo at feature level (slam-spec section 12, T38 to T40): the real filter on a simulated
/// room with known associations, so that its consistency is seen without a matcher's mistakes.
absl::StatusOr<nlohmann::ordered_json> RunPointsScenario(const SimArguments& arguments);

}  // namespace saccade
