#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <span>

#include "server/filter/filter_types.hpp"
#include "server/filter/koller_motion.hpp"

namespace saccade {

/// A point of the world that is known, and where it was seen.
struct KnownSight {
  Eigen::Vector3d point_in_world;  // [m]
  Eigen::Vector2d pixel;           // [px, distorted]
  Eigen::Matrix2d noise;           // R [px^2]
};

/// A camera in a known world: 15 numbers, M3, corrected in information form (Koller et al. 1997,
/// equations 3 to 5; slam-spec 2). No map, so a frame costs the same whatever it shows.
class LandmarkFilter {
 public:
  /// The camera is at `world_from_camera`, known to `covariance` [position (world), rotation
  /// (local)]; how it moves is not known, but for what hands do.
  void Reset(const Rigid3& world_from_camera, const Matrix6d& covariance);
  /// On by `dt` seconds, in steps of at most 1/30 s and at most a second's.
  void Predict(double dt, const KollerNoise& noise);
  /// Pixel of a known point, and its covariance without measurement noise; nothing if not in view.
  std::optional<PredictedPixel> Predicted(const CameraModel& camera,
                                          const Eigen::Vector3d& point_in_world) const;
  /// P+^-1 = P^-1 + sum H^T R^-1 H. `iterations`: 1 is the extended filter; more linearise again
  /// where the last came to. On error nothing changes:
  ///   InvalidArgument     a point that is not in view
  ///   FailedPrecondition  a noise or a covariance that is not positive definite
  absl::StatusOr<UpdateReport> Update(const CameraModel& camera, std::span<const KnownSight> seen,
                                      int iterations = 1);

  const KollerMotion& motion() const { return motion_; }
  const Matrix15d& covariance() const { return p_; }
  Rigid3 WorldFromCamera() const { return motion_.camera_from_world.Inverse(); }
  /// [position (world), rotation (local)].
  Matrix6d PoseCovariance() const;

 private:
  KollerMotion motion_;
  Matrix15d p_ = Matrix15d::Identity();
};

}  // namespace saccade
