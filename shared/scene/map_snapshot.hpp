#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

using FrameId = std::uint64_t;
using FeatureId = std::uint64_t;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Slam-spec section 2. Lost tracking is a state, not an error.
enum class TrackingStatus { kInitialising, kTracking, kCoasting, kLost, kRelocalising };

/// Quality of tracking: matched / attempted over the last 10 frames; good > 0.3, bad < 0.13.
enum class TrackingQuality { kUnknown, kBad, kPoor, kGood };

/// What became of a feature in this frame: its colour (D03): red, blue, yellow.
enum class FeatureState { kNotAttempted, kMeasured, kFailed };

/// One landmark as the filter has it after this frame, or as the map remembers it (at rest: out of
/// the filter until it comes back into view; then not attempted).
struct FeatureSnapshot {
  FeatureId id = 0;
  FeatureState state = FeatureState::kNotAttempted;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();       // [m]
  Eigen::Matrix3d covariance_in_world = Eigen::Matrix3d::Zero();  // marginal [m^2]
  /// Of the point expressed in the camera frame, cross terms with the camera pose included [m^2]:
  /// what matters for the error in the picture.
  Eigen::Matrix3d covariance_in_camera = Eigen::Matrix3d::Zero();
  bool depth_known = false;  // sigma of depth below 10 % of depth
  /// Where it was predicted or measured in this frame [px, distorted]; nothing if not in view.
  std::optional<Eigen::Vector2d> pixel;
  std::uint32_t matched_count = 0;  // frames in which it was measured so far
};

/// Wall-clock time of the tracker's stages for one frame [ms].
struct StageTimes {
  double predict_ms = 0, search_ms = 0, update_ms = 0, manage_ms = 0, total_ms = 0;
  /// For work on another core that is due at this frame; only offline, where frames come faster
  /// than time passes. Not part of the total.
  double waited_ms = 0;
};

/// Everything that readers may know of the map after one frame; immutable once published.
struct MapSnapshot {
  FrameId frame_id = 0;
  Timestamp capture_time_ns = 0;
  TrackingStatus status = TrackingStatus::kInitialising;
  TrackingQuality quality = TrackingQuality::kUnknown;
  std::string advice;   // what the wearer can do, in words; empty when all is well
  bool metric = false;  // world is in metres; false: scale arbitrary (no target seen)
  Rigid3 world_from_camera;
  Matrix6d pose_covariance = Matrix6d::Zero();  // [position m, local rotation rad], in that order
  Eigen::Vector3d velocity_in_world = Eigen::Vector3d::Zero();           // [m/s]
  Eigen::Vector3d angular_velocity_in_camera = Eigen::Vector3d::Zero();  // [rad/s]
  std::vector<FeatureSnapshot> features;
  int attempted = 0;        // features searched for in this frame
  int matched = 0;          // accepted by the filter
  double searched_px2 = 0;  // area of all ellipses searched in this frame; 0: not counted
  /// Rises whenever the map changed other than by a filter update: reset, relocalisation, loop.
  std::uint64_t map_revision = 0;
  /// Changes when the map is thrown away (reset): ids and coordinates before it mean nothing now.
  std::uint64_t map_generation = 0;
  StageTimes stage_ms;
};

}  // namespace saccade
