#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "server/eval/commands.hpp"

namespace saccade {

/// Whether `name` is a closed-loop scenario: fixate, saccade, saccade_fast, horizon, tour, spin.
bool IsGazeScenario(const std::string& name);
/// Their names, for people.
std::string GazeScenarioNames();

/// Runs one (docs/design/evaluation.md says what each does) and answers with the report; null where
/// a figure does not belong to the scenario.
absl::StatusOr<nlohmann::ordered_json> RunGazeScenario(const SimArguments& arguments);

}  // namespace saccade
