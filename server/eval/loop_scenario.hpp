#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "server/eval/commands.hpp"

namespace saccade {

/// T19: once round a square of 20 m with the real tracker, and a few metres on over known ground
/// (`CorridorSource`, with the same poster on every side), with and without loops closed; a mark
/// halfway round.
absl::StatusOr<nlohmann::ordered_json> RunLoopScenario(const SimArguments& arguments);

}  // namespace saccade
