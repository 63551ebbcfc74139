#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <random>
#include <vector>

#include "server/eval/points_world.hpp"
#include "server/filter/filter_state.hpp"
#include "server/filter/robust_pose.hpp"
#include "server/map/landmark.hpp"

namespace saccade {

/// What one frame came to, against the truth.
struct PointsTrackStep {
  double position_error_m = 0;
  double rotation_error_rad = 0;
  int attempted = 0, accepted = 0;
};

/// The tracker's way with its map at feature level, for runs of any length: search ellipses, robust
/// pose and soft gate, the real filter, the map's own books and rules for retirement (T16, T41,
/// T45). In place of pictures there are PointsWalk's observations.
class PointsTracker {
 public:
  /// `first`: the camera starts near it, off by what its covariance says.
  PointsTracker(const PointsWorld& world, const PointsOptions& options, const PointsFrame& first);

  /// Frames in order. An error is the filter's own.
  absl::StatusOr<PointsTrackStep> Step(const PointsFrame& frame);

  const FilterState& filter() const { return filter_; }
  /// Frames since a feature on this point was born; nothing if none lives.
  std::optional<int> AgeOf(int point) const;

 private:
  /// A feature that the prediction puts in view, and what is found there.
  struct Match {
    FeatureId id = 0;
    PoseEvidence evidence;
    bool known = false, found = false, accepted = false;
  };
  std::vector<Match> Search(const PointsFrame& frame) const;
  absl::Status Correct(std::vector<Match>& matches);
  void Retire(const std::vector<Match>& matches);
  absl::Status Birth(const PointsFrame& frame, int accepted);
  double MedianInverseRange(const std::vector<Match>& matches) const;

  const PointsWorld& world_;
  const PointsOptions options_;
  FilterState filter_;
  LandmarkMap map_;
  std::mt19937_64 random_;
  std::map<FeatureId, int> point_of_;       // of every living feature
  std::map<int, FeatureId> feature_on_;     // the same the other way round
  std::map<FeatureId, std::int64_t> born_;  // frame
  double inverse_range_ = 0.5;              // guess for new features [1/m]
  std::int64_t frame_ = -1;
  std::int64_t last_birth_ = -1000;
  bool followed_ = false;  // the frame before had matches
};

}  // namespace saccade
