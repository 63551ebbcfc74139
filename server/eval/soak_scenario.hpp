#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "server/eval/commands.hpp"
#include "server/eval/points_tracker.hpp"

namespace saccade {

/// What one long run came to.
struct SoakResult {
  double early_rmse_m = 0;  // of the position, from 10 to 20 s
  double late_rmse_m = 0;   // over the last 10 s
  double worst_m = 0;       // after the first 10 s
  double lost_at_s = -1;    // first moment more than 10 cm or 5 deg from the truth; -1: never
  std::size_t most_features = 0, most_states = 0;
  /// Least eigenvalue of P over its trace, at the worst of the checks (T5: above -1e-12).
  double least_eigenvalue_over_trace = 0;
  double memory_early_mb = 0,
         memory_late_mb = 0;  // resident, after a tenth of the run and at its end
  int moving_features = 0;    // that lived on the moving thing once it moved
  int slow_features = 0;      // of those, kept for more than 2 s after
  double slowest_s = 0;       // the longest such stay
};

/// One run of PointsTracker over options.duration_s. An error is the filter's own, with the time.
absl::StatusOr<SoakResult> RunSoak(const PointsOptions& options, const PointsSetup& setup);

/// `soak` (T41, T45) and `passerby` (T16) at feature level: runs of any length with the tracker's
/// rules for its map. In `passerby` somebody who stood before the wearer walks to and fro from 20 s
/// on. Nothing here notices that it is lost, nor finds back: what diverges stays so.
absl::StatusOr<nlohmann::ordered_json> RunSoakScenario(const SimArguments& arguments);

}  // namespace saccade
