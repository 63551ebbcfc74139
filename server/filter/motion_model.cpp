#include "server/filter/motion_model.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::Vector3d;

CameraMotion Plus(const CameraMotion& camera, const Vector12d& error) {
  CameraMotion moved = camera;
  moved.world_from_camera.translation += error.segment<3>(0);
  moved.world_from_camera.rotation =
      (camera.world_from_camera.rotation * ExpQuaternion(error.segment<3>(3))).normalized();
  moved.velocity_m_s += error.segment<3>(6);
  moved.angular_velocity_rad_s += error.segment<3>(9);
  return moved;
}

Vector12d Minus(const CameraMotion& to, const CameraMotion& from) {
  Vector12d error;
  error << to.world_from_camera.translation - from.world_from_camera.translation,
      LogQuaternion(from.world_from_camera.rotation.conjugate() * to.world_from_camera.rotation),
      to.velocity_m_s - from.velocity_m_s, to.angular_velocity_rad_s - from.angular_velocity_rad_s;
  return error;
}

CameraMotion TurnHead(const CameraMotion& camera, const Rigid3& camera_from_next) {
  const Vector3d& w = camera.angular_velocity_rad_s;
  CameraMotion next;
  next.world_from_camera = camera.world_from_camera * camera_from_next;
  next.velocity_m_s = camera.velocity_m_s +
                      camera.world_from_camera.rotation * w.cross(camera_from_next.translation);
  next.angular_velocity_rad_s = camera_from_next.rotation.conjugate() * w;
  return next;
}

MotionJacobians LineariseHead(const CameraMotion& camera, const HeadMotion& head) {
  const Matrix3d r = camera.world_from_camera.RotationMatrix();
  const Matrix3d back = head.camera_from_next.RotationMatrix().transpose();
  const Vector3d& d = head.camera_from_next.translation;
  const Vector3d& w = camera.angular_velocity_rad_s;
  MotionJacobians result;
  result.f.block<3, 3>(0, 3) = -r * Skew(d);
  result.f.block<3, 3>(3, 3) = back;
  result.f.block<3, 3>(6, 3) = -r * Skew(w.cross(d));
  result.f.block<3, 3>(6, 9) = -r * Skew(d);
  result.f.block<3, 3>(9, 9) = back;
  Eigen::Matrix<double, 12, 6> g = Eigen::Matrix<double, 12, 6>::Zero();
  g.block<3, 3>(0, 0) = r;
  g.block<3, 3>(3, 3) = Matrix3d::Identity();
  g.block<3, 3>(6, 0) = r * Skew(w);
  g.block<3, 3>(9, 3) = Skew(back * w);
  result.q.noalias() = g * head.covariance * g.transpose();
  return result;
}

Rigid3 PlusPose(const Rigid3& pose, const Eigen::Matrix<double, 6, 1>& error) {
  return {(pose.rotation * ExpQuaternion(error.tail<3>())).normalized(),
          pose.translation + error.head<3>()};
}

void PoseByOrigin(const Rigid3& pose, const Rigid3& origin, Eigen::Ref<Eigen::MatrixXd> rows) {
  const Matrix3d turn = origin.rotation.toRotationMatrix();
  rows.block<3, 3>(0, 0).setIdentity();
  rows.block<3, 3>(0, 3) = -Skew(pose.translation - origin.translation) * turn;
  rows.block<3, 3>(3, 3) = pose.rotation.toRotationMatrix().transpose() * turn;
}

}  // namespace saccade
