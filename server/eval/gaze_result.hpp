#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>

#include "server/eval/claims.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/statistics.hpp"

namespace saccade {

/// What one run adds to the report.
struct GazeResult {
  Sample squared_error_deg, squared_roll_deg;  // per control step
  Sample arrival_s, command_to_motion_ms;
  double overshoot_deg = 0;
  int asked = 0, arrived = 0, refused_clicks = 0;
  std::optional<double> drift_first_m, drift_last_m, orientation_end_deg, search_area_ratio;
  int false_depth = 0, features = 0;
  std::uint64_t frames = 0, lost_frames = 0, initialising_frames = 0;
  Sample measured;
  double peak_rate_deg_s = 0;
  ClaimTotals claims;

  void Add(const GazeResult& other);
};

/// The square root of the mean; null of an empty sample.
nlohmann::ordered_json RootMean(const Sample& squares);

/// report.json of one run or of several together; null where a figure does not belong.
nlohmann::ordered_json GazeReportOf(const SimArguments& arguments, const GazeResult& result);

}  // namespace saccade
