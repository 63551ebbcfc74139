#include "server/tracker/encoder_motion.hpp"

#include <algorithm>

namespace saccade {
namespace {

constexpr double kTimeSigma_s = 0.5e-3;  // of the encoders' time stamps against the pictures'

}  // namespace

HeadMotion EncoderMotion(const MountModel& model, const MountAngles& before,
                         const MountAngles& after, double dt, bool metric) {
  const Rigid3 camera_from_mount = model.MountFromCamera(before).Inverse();
  HeadMotion head;
  head.camera_from_next = camera_from_mount * model.MountFromCamera(after);
  const Eigen::Matrix3d to_camera = camera_from_mount.RotationMatrix();
  const Eigen::Matrix3d back = head.camera_from_next.RotationMatrix().transpose();
  const Eigen::Matrix<double, 6, 3> from = model.Jacobian(before), to = model.Jacobian(after);
  // T^-1 T': the first reading's error turns and moves what the second one sees.
  Eigen::Matrix<double, 6, 6> by_angles;
  by_angles.topLeftCorner<3, 3>() = Skew(head.camera_from_next.translation) * from.bottomRows<3>() -
                                    to_camera * from.topRows<3>();
  by_angles.bottomLeftCorner<3, 3>() = -back * from.bottomRows<3>();
  by_angles.topRightCorner<3, 3>() = to_camera * to.topRows<3>();
  by_angles.bottomRightCorner<3, 3>() = to.bottomRows<3>();
  const Eigen::Vector3d rate = (ToVector(after) - ToVector(before)) / dt;
  const double encoder = model.options().encoder_sigma_rad;
  const Eigen::Vector3d variance = (kTimeSigma_s * rate).cwiseAbs2().array() + encoder * encoder;
  const Eigen::Matrix<double, 6, 1> both = variance.replicate<2, 1>();
  head.covariance = by_angles * both.asDiagonal() * by_angles.transpose();
  if (!metric) {
    const Eigen::Vector3d path = head.camera_from_next.translation;
    head.covariance.topLeftCorner<3, 3>() += path * path.transpose();
    head.camera_from_next.translation.setZero();
  }
  return head;
}

double RateWhenExposed(double mean_rad_s, double mean_before_rad_s) {
  const double speeding_up = std::max(0.0, mean_rad_s - mean_before_rad_s);
  return mean_rad_s + speeding_up;
}

}  // namespace saccade
