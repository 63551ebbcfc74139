#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <random>

#include "server/eval/points_tracker.hpp"
#include "server/eval/points_world.hpp"

namespace saccade {

/// The textbook's filter on one PointsWorld: points as x, y, z in world, one dense covariance,
/// linearised at the prediction (Davison 2003). What other forms of a feature are held against
/// (T14). Iterated, it is far worse: each frame's noise passes for a baseline (NEES 47 for 5.9).
///
/// It is helped where it is known to be weak: a point enters with its range known to 10 %, which is
/// where inverse depths become points (slam-spec 5.4), drawn about the truth.
class XyzFilter {
 public:
  XyzFilter(const PointsWorld& world, const PointsOptions& options);
  /// Frames in order, from 0; `nis` is not set.
  absl::StatusOr<PointsStep> Step(std::size_t frame);

 private:
  struct Row {
    int offset = -1;  // of its point; -1: known
    Eigen::Vector3d known = Eigen::Vector3d::Zero();
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  };
  std::vector<Row> Match(const PointsFrame& frame) const;
  absl::Status Update(const std::vector<Row>& rows);
  void Birth(const PointsFrame& frame, std::size_t matched);
  Eigen::Vector3d PlaceOf(const Row& row) const;

  const PointsWorld& world_;
  const PointsOptions options_;
  CameraMotion camera_;
  Eigen::VectorXd points_;  // 3 numbers each; those of offset k begin at k - 12
  Eigen::MatrixXd p_;       // 12 + 3 a point
  std::map<int, int> offset_of_point_;
  std::mt19937_64 random_;
};

}  // namespace saccade
