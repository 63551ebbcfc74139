#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "server/eval/commands.hpp"

namespace saccade {

/// T18, through the real tracker: it maps the simulated desk, loses sight, and sees the room again
/// from poses it was never at (`runs` of them, within 30 cm and 20 deg of its path, each from the
/// same map), and other places (five times as many pictures), where it must stay lost.
absl::StatusOr<nlohmann::ordered_json> RunRelocScenario(const SimArguments& arguments);

}  // namespace saccade
