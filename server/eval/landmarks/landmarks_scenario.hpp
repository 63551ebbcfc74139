#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <nlohmann/json.hpp>

#include "server/eval/commands.hpp"

namespace saccade {

/// "squares": eight squares, half of them and then all covered for a while (T23); Koller's tracker
/// unless `--set tracker=` says otherwise. "flip": one small square near frontal, of unknown place.
/// "away": from known squares into the part of a hall without any, and back.
bool IsLandmarksScenario(absl::string_view name);
std::string LandmarksScenarioNames();
double LandmarksDuration_s(absl::string_view name);

/// Writes trajectory.tum, groundtruth.txt, frames.csv, landmarks.toml and squares.csv (frame,
/// square, covered, not_attempted | measured | failed) of each run into its folder.
absl::StatusOr<nlohmann::ordered_json> RunLandmarksScenario(const SimArguments& arguments);

}  // namespace saccade
