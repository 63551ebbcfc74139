#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "server/eval/commands.hpp"

namespace saccade {

/// T14: position NEES of bearing and range (SID) and of range alone (ESID) against the textbook's
/// points, on the same rooms at feature level.
absl::StatusOr<nlohmann::ordered_json> RunFormsScenario(const SimArguments& arguments);

}  // namespace saccade
