#include "server/filter/point_model.hpp"

#include <cmath>

#include "shared/geometry/so3.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Eigen::Matrix<double, 3, 2> TangentBasis(const Vector3d& bearing) {
  // Cross with the axis that is least along the bearing.
  Eigen::Index axis = 0;
  bearing.cwiseAbs().minCoeff(&axis);
  const Vector3d first = bearing.cross(Vector3d::Unit(axis)).normalized();
  Eigen::Matrix<double, 3, 2> basis;
  basis << first, bearing.cross(first);
  return basis;
}

void MoveBearing(const Vector2d& error, Vector3d& bearing, Eigen::Matrix<double, 3, 2>& basis) {
  // The rotation that carries b along the direction B d by the angle |d|.
  const Eigen::Quaterniond turn = ExpQuaternion(bearing.cross(basis * error));
  bearing = (turn * bearing).normalized();
  basis.col(0) = turn * basis.col(0);
  basis.col(0) = (basis.col(0) - bearing * bearing.dot(basis.col(0))).normalized();
  basis.col(1) = bearing.cross(basis.col(0));
}

std::optional<PixelPrediction> PredictFromClone(const CameraModel& camera,
                                                const Rigid3& world_from_camera,
                                                const PointFromClone& point) {
  const Matrix3d camera_from_world = world_from_camera.rotation.conjugate().toRotationMatrix();
  const Matrix3d camera_from_clone =
      camera_from_world * point.world_from_clone.rotation.toRotationMatrix();
  const Vector3d base =
      camera_from_world * (point.world_from_clone.translation - world_from_camera.translation);
  PixelPrediction result;
  result.ray = camera_from_clone * point.bearing + point.inverse_range * base;
  Eigen::Matrix<double, 2, 3> d_ray;
  const auto pixel = camera.Project(result.ray, &d_ray);
  if (!pixel) return std::nullopt;
  result.pixel = *pixel;
  const Eigen::Matrix<double, 2, 3> d_position = point.inverse_range * (d_ray * camera_from_world);
  result.d_camera.leftCols<3>() = -d_position;
  result.d_camera.rightCols<3>() = d_ray * Skew(result.ray);
  const Eigen::Matrix<double, 2, 3> d_bearing = d_ray * camera_from_clone;
  result.d_clone.leftCols<3>() = d_position;
  result.d_clone.rightCols<3>() = -d_bearing * Skew(point.bearing);
  result.d_point.leftCols<2>() = d_bearing * point.basis;
  result.d_point.col(2) = d_ray * base;
  return result;
}

std::optional<PixelPrediction> PredictFixed(const CameraModel& camera,
                                            const Rigid3& world_from_camera,
                                            const Vector3d& point_in_world) {
  const Matrix3d camera_from_world = world_from_camera.rotation.conjugate().toRotationMatrix();
  PixelPrediction result;
  result.ray = camera_from_world * (point_in_world - world_from_camera.translation);
  Eigen::Matrix<double, 2, 3> d_ray;
  const auto pixel = camera.Project(result.ray, &d_ray);
  if (!pixel) return std::nullopt;
  result.pixel = *pixel;
  result.d_camera.leftCols<3>() = -d_ray * camera_from_world;
  result.d_camera.rightCols<3>() = d_ray * Skew(result.ray);
  result.d_clone.setZero();
  result.d_point.setZero();
  return result;
}

std::optional<Vector2d> PixelFromClone(const CameraModel& camera, const Rigid3& world_from_camera,
                                       const PointFromClone& point) {
  return camera.Project(
      world_from_camera.rotation.conjugate() *
      (point.world_from_clone.rotation * point.bearing +
       point.inverse_range * (point.world_from_clone.translation - world_from_camera.translation)));
}

}  // namespace saccade
