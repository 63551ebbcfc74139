#include "server/eval/gaze_result.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

template <typename T>
void TakeWorst(std::optional<T>& mine, const std::optional<T>& other) {
  if (other) mine = mine ? std::max(*mine, *other) : *other;
}

Json OrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }
double Least(const Sample& sample) {
  return sample.size() == 0 ? 0.0
                            : *std::min_element(sample.values().begin(), sample.values().end());
}

}  // namespace

Json RootMean(const Sample& squares) {
  return squares.size() == 0 ? Json(nullptr) : Json(std::sqrt(squares.Mean()));
}

void GazeResult::Add(const GazeResult& other) {
  squared_error_deg.Add(other.squared_error_deg);
  squared_roll_deg.Add(other.squared_roll_deg);
  arrival_s.Add(other.arrival_s);
  command_to_motion_ms.Add(other.command_to_motion_ms);
  overshoot_deg = std::max(overshoot_deg, other.overshoot_deg);
  asked += other.asked;
  arrived += other.arrived;
  refused_clicks += other.refused_clicks;
  TakeWorst(drift_first_m, other.drift_first_m);
  TakeWorst(drift_last_m, other.drift_last_m);
  TakeWorst(orientation_end_deg, other.orientation_end_deg);
  TakeWorst(search_area_ratio, other.search_area_ratio);
  false_depth += other.false_depth;
  features += other.features;
  frames += other.frames;
  lost_frames += other.lost_frames;
  initialising_frames += other.initialising_frames;
  measured.Add(other.measured);
  peak_rate_deg_s = std::max(peak_rate_deg_s, other.peak_rate_deg_s);
  claims.Add(other.claims);
}

Json GazeReportOf(const SimArguments& arguments, const GazeResult& result) {
  Json report;
  report["scenario"] = arguments.scenario;
  report["seed"] = arguments.seed;
  report["duration_s"] = arguments.duration_s;
  report["runs"] = arguments.runs;
  report["frames"] = result.frames;
  report["lost_frames"] = result.lost_frames;
  report["initialising_frames"] = result.initialising_frames;
  report["features_measured_min"] = Least(result.measured);
  report["features_measured_p5"] = result.measured.Percentile(5);
  report["gaze_error_rms_deg"] = RootMean(result.squared_error_deg);
  report["arrival_s"] = nullptr;
  if (result.arrival_s.size() > 0) {
    report["arrival_s"] = {{"min", Least(result.arrival_s)},
                           {"median", result.arrival_s.Percentile(50)},
                           {"max", result.arrival_s.Max()}};
  }
  report["peak_rate_deg_s"] = result.peak_rate_deg_s;
  report["overshoot_deg_max"] = result.asked > 0 ? Json(result.overshoot_deg) : Json(nullptr);
  report["roll_rms_deg"] = RootMean(result.squared_roll_deg);
  report["asked"] = result.asked;
  report["arrived"] = result.arrived;
  report["refused_clicks"] = result.refused_clicks;
  report["search_area_ratio"] = OrNull(result.search_area_ratio);
  report["ate_se3_drift_m"] = nullptr;
  if (result.drift_first_m) {
    report["ate_se3_drift_m"] = {{"first_minute", *result.drift_first_m},
                                 {"last_minute", *result.drift_last_m}};
  }
  report["orientation_error_end_deg"] = OrNull(result.orientation_end_deg);
  report["false_depth_features"] = result.false_depth;
  report["features_total"] = result.features;
  report["command_to_motion_ms"] = nullptr;
  if (result.command_to_motion_ms.size() > 0) {
    report["command_to_motion_ms"] = {{"p50", result.command_to_motion_ms.Percentile(50)},
                                      {"p99", result.command_to_motion_ms.Percentile(99)}};
  }
  report["claims"] = result.claims.Report();
  return report;
}

}  // namespace saccade
