#include "server/eval/soak_scenario.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>

#include "server/eval/output_file.hpp"
#include "server/eval/registration.hpp"
#include "server/eval/statistics.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kEarlyFrom_s = 10.0, kEarlyTo_s = 20.0, kLate_s = 10.0;
constexpr double kCheckEvery_s = 20.0;  // the whole of P
constexpr double kPatience_s = 2.0;     // T16
constexpr int kMovingPoints = 10;

double ResidentMb() {
  std::ifstream file("/proc/self/statm");
  double pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

/// Least eigenvalue of the covariance over its trace; an error if it is not finite.
absl::StatusOr<double> LeastEigenvalue(const FilterState& filter) {
  const Eigen::MatrixXd p = filter.FullCovariance();
  if (!p.allFinite()) return absl::FailedPreconditionError("the covariance is not finite");
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(p, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().minCoeff() / p.trace();
}

/// Follows the features that live on what moves.
class MovingBook {
 public:
  explicit MovingBook(const PointsOptions& options) : options_(options) {}

  void Look(const PointsTracker& tracker, double time_s, SoakResult& result) {
    if (time_s < options_.moving_from_s) return;
    for (const Landmark& landmark : tracker.tracker().map().in_use().all()) {
      const int point = PointsFrontEnd::PointOf(landmark.patch);
      if (point < options_.points - options_.moving_points) continue;
      const auto [entry, fresh] = since_.try_emplace(landmark.id, time_s);
      result.moving_features += fresh ? 1 : 0;
      const double stay_s = time_s - entry->second;
      if (stay_s > kPatience_s && stay_s <= kPatience_s + 1.0 / options_.fps) {
        ++result.slow_features;
      }
      result.slowest_s = std::max(result.slowest_s, stay_s);
    }
  }

 private:
  const PointsOptions& options_;
  std::map<FeatureId, double> since_;  // when it began to be wrong
};

}  // namespace

absl::StatusOr<SoakResult> RunSoak(const PointsOptions& options, const PointsSetup& setup) {
  PointsWalk walk(options);
  const auto frames = static_cast<std::int64_t>(std::lround(options.duration_s * options.fps));
  const auto check_every = static_cast<std::int64_t>(std::lround(kCheckEvery_s * options.fps));
  SoakResult result;
  MovingBook moving(options);
  Sample early, late;
  const PointsFrame& first = walk.Next();
  auto tracker = PointsTracker::Create(walk.world(), options, setup, first);
  if (!tracker.ok()) return tracker.status();
  for (std::int64_t i = 0; i < frames; ++i) {
    const double time_s = static_cast<double>(i) / options.fps;
    const PointsFrame& frame = i == 0 ? first : walk.Next();
    const auto step = tracker->Step(frame);
    if (!step.ok()) {
      return absl::Status(
          step.status().code(),
          absl::StrFormat("seed %d at %.2f s: %s", options.seed, time_s, step.status().message()));
    }
    const double squared = step->position_error_m * step->position_error_m;
    if (time_s >= kEarlyFrom_s && time_s < kEarlyTo_s) early.Add(squared);
    if (time_s >= options.duration_s - kLate_s) late.Add(squared);
    if (time_s >= kEarlyFrom_s) result.worst_m = std::max(result.worst_m, step->position_error_m);
    const bool lost =
        step->position_error_m > kLostPosition_m || step->rotation_error_rad > kLostRotation_rad;
    if (lost && result.lost_at_s < 0) result.lost_at_s = time_s;
    const FilterState& filter = tracker->tracker().filter();
    result.most_features = std::max(result.most_features, filter.feature_count());
    result.most_states = std::max(result.most_states, static_cast<std::size_t>(filter.dim()));
    moving.Look(*tracker, time_s, result);
    if (i == frames / 10) result.memory_early_mb = ResidentMb();
    if (i % check_every != check_every - 1 && i != frames - 1) continue;
    const absl::StatusOr<double> least = LeastEigenvalue(filter);
    if (!least.ok()) return least.status();
    result.least_eigenvalue_over_trace = std::min(result.least_eigenvalue_over_trace, *least);
  }
  result.memory_late_mb = ResidentMb();
  result.early_rmse_m = std::sqrt(early.Mean());
  result.late_rmse_m = std::sqrt(late.Mean());
  return result;
}

absl::StatusOr<Json> RunSoakScenario(const SimArguments& arguments) {
  if (const absl::Status status = CreateFolder(arguments.out); !status.ok()) return status;
  PointsOptions options;
  options.duration_s = arguments.duration_s;
  options.moving_points = arguments.scenario == "passerby" ? kMovingPoints : 0;
  Json runs = Json::array();
  Sample early, late, ratio, worst, slowest;
  double least = 0.0, growth_mb = 0.0;
  std::size_t features = 0, states = 0;
  int moving = 0, slow = 0, failed = 0, lost = 0;
  for (int run = 0; run < arguments.runs; ++run) {
    options.seed = arguments.seed + static_cast<std::uint64_t>(run);
    const Timestamp begin = MonotonicNow();
    const absl::StatusOr<SoakResult> result = RunSoak(options, MakePointsSetup(options));
    if (!result.ok()) {
      std::cerr << result.status().message() << "\n";
      ++failed;
      continue;
    }
    std::cerr << absl::StrFormat("run %d of %d: %.1f s, %.2f mm early, %.2f mm late\n", run + 1,
                                 arguments.runs, Seconds(MonotonicNow() - begin),
                                 1e3 * result->early_rmse_m, 1e3 * result->late_rmse_m);
    runs.push_back({{"seed", options.seed},
                    {"early_rmse_m", result->early_rmse_m},
                    {"late_rmse_m", result->late_rmse_m},
                    {"worst_m", result->worst_m},
                    {"lost_at_s", result->lost_at_s},
                    {"most_features", result->most_features},
                    {"slowest_moving_feature_s", result->slowest_s}});
    early.Add(result->early_rmse_m * result->early_rmse_m);
    late.Add(result->late_rmse_m * result->late_rmse_m);
    ratio.Add(result->late_rmse_m / result->early_rmse_m);
    worst.Add(result->worst_m);
    slowest.Add(result->slowest_s);
    least = std::min(least, result->least_eigenvalue_over_trace);
    growth_mb = std::max(growth_mb, result->memory_late_mb - result->memory_early_mb);
    features = std::max(features, result->most_features);
    states = std::max(states, result->most_states);
    lost += result->lost_at_s >= 0 ? 1 : 0;
    moving += result->moving_features;
    slow += result->slow_features;
  }
  Json report;
  report["scenario"] = arguments.scenario;
  report["seed"] = arguments.seed;
  report["duration_s"] = arguments.duration_s;
  report["runs"] = arguments.runs;
  report["broken_runs"] = failed;
  report["lost_runs"] = lost;
  report["early_rmse_m"] = std::sqrt(early.Mean());
  report["late_rmse_m"] = std::sqrt(late.Mean());
  report["late_over_early"] = std::sqrt(late.Mean() / early.Mean());
  report["late_over_early_runs"] = {{"median", ratio.Percentile(50)}, {"max", ratio.Max()}};
  report["worst_m"] = worst.Max();
  report["most_features"] = features;
  report["most_states"] = states;
  report["least_eigenvalue_over_trace"] = least;
  report["memory_growth_mb"] = growth_mb;
  report["moving_features"] = moving;
  report["moving_features_kept_over_2_s"] = slow;
  report["slowest_moving_feature_s"] = slowest.Max();
  report["per_run"] = std::move(runs);
  return report;
}

}  // namespace saccade
