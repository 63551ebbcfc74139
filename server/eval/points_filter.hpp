#pragma once

#include <absl/status/status.h>

#include <random>
#include <set>
#include <vector>

#include "server/eval/points_world.hpp"
#include "server/filter/filter_state.hpp"
#include "server/filter/robust_pose.hpp"

namespace saccade {

/// What the filter is told about the room.
enum class PointsMode {
  kKnownMap,  // every point is known: localisation only (T39)
  kSlamFej,   // the target's points are known, the others are mapped; first-estimates Jacobians
              // (T40)
  kSlam,      // the same with Jacobians at the current estimates after the first updates, as the
              // tracker runs
};

/// What one frame did to the filter, against the truth.
struct PointsStep {
  double nees = 0;           // of the 6-D pose
  double position_nees = 0;  // of its 3-D position
  double nis = 0;  // of all matches together: chi-square with 2 * matches degrees of freedom
  int matches = 0;
  double position_error_m = 0;
  double rotation_error_rad = 0;
};

/// The real filter on one PointsWorld. The first estimate is drawn from the first covariance, so
/// that a consistent filter is consistent from the first frame on.
class PointsFilter {
 public:
  PointsFilter(const PointsWorld& world, const PointsOptions& options, PointsMode mode);

  /// Frames in order, from 0. An error is the filter's own: a covariance that broke.
  absl::StatusOr<PointsStep> Step(std::size_t frame);
  const FilterState& filter() const { return filter_; }

 private:
  std::vector<Observation> Match(const PointsFrame& frame) const;
  /// Moves some matches to anywhere in their ellipses (PointsOptions::false_matches).
  void Falsify(std::vector<Observation>& matches);
  /// Where the tracker would linearise: the robust pose of these matches. Without `soft_gate` all
  /// of them are used afterwards, whatever their weight; with it they are weighted, and outliers
  /// leave.
  Rigid3 LinearisationPose(std::vector<Observation>& matches);
  absl::Status Birth(const PointsFrame& frame, std::size_t matched);
  bool IsKnown(int point) const;
  double MedianInverseRange(const PointsFrame& frame) const;

  const PointsWorld& world_;
  const PointsOptions options_;
  const PointsMode mode_;
  FilterState filter_;
  std::set<int> mapped_;  // points that were ever born; a removed one does not come back
  FeatureId next_id_ = 1;
  std::mt19937_64 random_;
  std::vector<FeatureId> id_of_point_;  // 0: none
};

}  // namespace saccade
