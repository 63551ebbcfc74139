#include "server/filter/constant_velocity.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

CameraMotion PropagateMotion(const CameraMotion& camera, double dt,
                             const Eigen::Matrix<double, 6, 1>& impulse) {
  CameraMotion next = camera;
  next.velocity_m_s += impulse.head<3>();
  next.angular_velocity_rad_s += impulse.tail<3>();
  next.world_from_camera.translation += dt * next.velocity_m_s;
  next.world_from_camera.rotation =
      (camera.world_from_camera.rotation * ExpQuaternion(dt * next.angular_velocity_rad_s))
          .normalized();
  return next;
}

MotionJacobians LineariseMotion(const CameraMotion& camera, const Quaterniond& first_rotation,
                                double dt, const MotionNoise& noise) {
  const Vector3d angle = dt * camera.angular_velocity_rad_s;
  const Quaterniond next = camera.world_from_camera.rotation * ExpQuaternion(angle);
  const Matrix3d identity = Matrix3d::Identity();
  const Matrix3d turn = dt * RightJacobianSo3(angle);
  MotionJacobians result;
  result.f.block<3, 3>(0, 6) = dt * identity;
  result.f.block<3, 3>(3, 3) = (next.conjugate() * first_rotation).toRotationMatrix();
  result.f.block<3, 3>(3, 9) = turn;
  Eigen::Matrix<double, 12, 6> g = Eigen::Matrix<double, 12, 6>::Zero();
  g.block<3, 3>(0, 0) = dt * identity;
  g.block<3, 3>(3, 3) = turn;
  g.block<3, 3>(6, 0) = identity;
  g.block<3, 3>(9, 3) = identity;
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << Vector3d::Constant(dt * noise.acceleration_m_s2),
      Vector3d::Constant(dt * noise.angular_acceleration_rad_s2);
  g *= sigma.asDiagonal();
  result.q.noalias() = g * g.transpose();
  return result;
}

namespace {

constexpr int kVelocity = 6;  // where its errors are

class ConstantVelocityModel final : public MotionModel {
 public:
  ConstantVelocityModel() : MotionModel(12, kVelocity) {}

  CameraMotion Plus(const CameraMotion& motion, const Errors& error) const override {
    return saccade::Plus(motion, error);
  }
  Errors Minus(const CameraMotion& to, const CameraMotion& from) const override {
    return saccade::Minus(to, from);
  }
  Step Predict(const CameraMotion& motion, const Quaterniond& first_rotation, double dt,
               const MotionNoise& noise) const override {
    const MotionJacobians by = LineariseMotion(motion, first_rotation, dt, noise);
    return {PropagateMotion(motion, dt), by.f, by.q};
  }
  Step Turn(const CameraMotion& motion, const HeadMotion& head) const override {
    const MotionJacobians by = LineariseHead(motion, head);
    return {TurnHead(motion, head.camera_from_next), by.f, by.q};
  }
  Errors OfScale(const Errors& error) const override {
    Errors lengths = Errors::Zero(dim());
    lengths.head<3>() = error.head<3>();
    lengths.segment<3>(kVelocity) = error.segment<3>(kVelocity);
    return lengths;
  }
  void ByOrigin(const CameraMotion& motion, const Rigid3& origin,
                Eigen::Ref<Eigen::MatrixXd> rows) const override {
    const Matrix3d turn = origin.rotation.toRotationMatrix();
    PoseByOrigin(motion.world_from_camera, origin, rows.topRows<6>());
    rows.block<3, 3>(kVelocity, 3) = -Skew(motion.velocity_m_s) * turn;
  }
  Square InMovedWorld(const Matrix3d& turn) const override {
    Square by = Square::Identity(dim(), dim());
    by.topLeftCorner<3, 3>() = by.block<3, 3>(kVelocity, kVelocity) = turn;
    return by;
  }
};

}  // namespace

const MotionModel& ConstantVelocity() {
  static const ConstantVelocityModel model;
  return model;
}

}  // namespace saccade
