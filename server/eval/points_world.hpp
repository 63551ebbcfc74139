#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <memory>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A simulated room at feature level (slam-spec section 12).
struct PointsOptions {
  std::uint64_t seed = 1;
  double duration_s = 60.0;
  double fps = 30.0;
  int points = 300;
  double noise_px = 1.0;  // sigma of each coordinate
  /// The `worn` profile's impulses [m/s^2, rad/s^2]: the motion is drawn from the filter's own
  /// model, so that its consistency can be tested at all.
  double linear_sigma = 1.0;
  double angular_sigma = 6.0;
  /// Points of the start-up target; they come first in `points` and are seen from the start.
  int target_points = 6;
  /// Share of the matches that are false: anywhere within their search ellipse of 3 sigma.
  double false_matches = 0.0;
  /// The last of the points stand together on something that starts to move about at this time
  /// [s]: somebody in the room (T16).
  int moving_points = 0;
  double moving_from_s = 20.0;
};

struct PointObservation {
  int point = 0;  // index into PointsWorld::points
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// What is true at one frame, and what the camera reports of it.
struct PointsFrame {
  Rigid3 world_from_camera;
  Eigen::Vector3d velocity_in_world = Eigen::Vector3d::Zero();           // [m/s]
  Eigen::Vector3d angular_velocity_in_camera = Eigen::Vector3d::Zero();  // [rad/s]
  std::vector<PointObservation> observations;                            // by rising point
};

/// Room of 4 x 4 x 2.5 m: world has its origin in the middle of the room, y down, z towards the
/// wall with the target. The wearer stands near the origin, sways, and looks around by 35 degrees.
struct PointsWorld {
  CameraModel camera;
  double dt_s = 0;
  std::vector<Eigen::Vector3d> points;
  std::vector<PointsFrame> frames;
};

/// The same options give the same world.
PointsWorld MakePointsWorld(const PointsOptions& options);

/// The same world frame by frame, for runs that are too long to be held.
class PointsWalk {
 public:
  explicit PointsWalk(const PointsOptions& options);
  ~PointsWalk();
  /// Without frames.
  const PointsWorld& world() const { return world_; }
  /// The next frame; valid until the call after.
  const PointsFrame& Next();

 private:
  class Draw;
  PointsOptions options_;
  std::unique_ptr<Draw> draw_;
  PointsWorld world_;
  PointsFrame state_;
  int next_ = 0;
};

/// Where point `i` is at `time_s` [m, world].
Eigen::Vector3d PointAt(const PointsWorld& world, const PointsOptions& options, int i,
                        double time_s);

}  // namespace saccade
