#pragma once

#include <absl/status/status.h>

#include <array>
#include <random>
#include <vector>

#include "server/filter/filter_state.hpp"

namespace saccade {

enum FilterStage { kPredict, kPredictions, kRobustPose, kUpdate, kAll, kFilterStages };

/// The work of a tracker's filter on one frame after another: somebody who sways by a few
/// centimetres before things 1 to 4 m away, all of them always in view, and measured.
class FilterRun {
 public:
  /// Puts `robot` at the start; `first_id`: of its features, which are to be its own.
  FilterRun(int features, FilterState& filter, RobotId robot = kFirstRobot, FeatureId first_id = 1);

  static FilterOptions Options(PointForm form);
  /// What is known of the camera at the start.
  static Matrix12d StartCovariance();

  bool complete() const { return born_ == points_.size(); }
  /// One frame. `ms` receives the times of the stages.
  absl::Status Step(std::array<double, kFilterStages>& ms);
  /// Steps until all features are born and the first-estimates updates of a map are past.
  absl::Status WarmUp();
  /// The filter must really have worked.
  double PositionError() const;

 private:
  Eigen::Vector2d PixelOf(std::size_t point);
  std::vector<Observation> See();
  absl::Status Birth();

  CameraModel lens_;
  FilterState& filter_;
  const RobotId robot_;
  const FeatureId first_id_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector3d> points_;
  std::size_t born_ = 0;
  Rigid3 truth_;
  int frame_ = 0;
};

}  // namespace saccade
