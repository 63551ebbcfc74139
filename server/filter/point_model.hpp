#pragma once

#include <Eigen/Dense>
#include <optional>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// How a feature is written in the state.
enum class PointForm {
  kBearingRange,  // SID: unit bearing (2-D tangent) and inverse range in a clone of the camera
  kRangeOnly,     // ESID: the same with the bearing frozen; 1 number
};

/// A point as its clone of the camera sees it.
struct PointInClone {
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  // unit
  Eigen::Matrix<double, 3, 2> basis =
      Eigen::Matrix<double, 3, 2>::Zero();  // tangent of the bearing: b [+] d
  double inverse_range = 1.0;               // [1/m]; may be slightly below 0 while uncertain
};

/// A point seen from a clone: direction and inverse range there.
struct PointFromClone {
  Rigid3 world_from_clone;
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  // unit, in the clone
  Eigen::Matrix<double, 3, 2> basis =
      Eigen::Matrix<double, 3, 2>::Zero();  // tangent of the bearing: b [+] d
  double inverse_range = 1.0;               // [1/m]; may be slightly below 0 while uncertain
};

/// Some orthonormal basis of the plane normal to the unit vector `bearing`.
Eigen::Matrix<double, 3, 2> TangentBasis(const Eigen::Vector3d& bearing);

/// Moves a bearing by `error` in its tangent plane and carries the basis along (no twist, so that
/// the covariance needs no correction to first order).
void MoveBearing(const Eigen::Vector2d& error, Eigen::Vector3d& bearing,
                 Eigen::Matrix<double, 3, 2>& basis);

/// Where a point appears, and how that depends on everything.
struct PixelPrediction {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // [px, distorted]
  /// Direction of the point in the camera, scaled: X = R b + rho t for points of clones [1],
  /// the point itself for fixed ones [m].
  Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, 2, 6> d_camera;  // [position, rotation] of the camera
  Eigen::Matrix<double, 2, 6> d_clone;   // [position, rotation] of the clone
  Eigen::Matrix<double, 2, 3> d_point;   // [bearing tangent (2), inverse range]
};

/// Projects a point of a clone; nothing if it is behind the camera or outside the lens.
std::optional<PixelPrediction> PredictFromClone(const CameraModel& camera,
                                                const Rigid3& world_from_camera,
                                                const PointFromClone& point);
/// Projects a fixed point [m, world]; d_clone and d_point are not set.
std::optional<PixelPrediction> PredictFixed(const CameraModel& camera,
                                            const Rigid3& world_from_camera,
                                            const Eigen::Vector3d& point_in_world);
/// Pixel only, of either.
std::optional<Eigen::Vector2d> PixelFromClone(const CameraModel& camera,
                                              const Rigid3& world_from_camera,
                                              const PointFromClone& point);

}  // namespace saccade
