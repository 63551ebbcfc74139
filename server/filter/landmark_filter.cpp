#include "server/filter/landmark_filter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

// Of a hand or a head that nothing is known of yet.
constexpr double kSpeed_m_s = 0.5, kTurn_rad_s = 1.0, kAcceleration_m_s2 = 2.0;
constexpr double kLongestStep_s = 1.0 / 30.0;

using Rows = Eigen::Matrix<double, 2, 15>;

}  // namespace

void LandmarkFilter::Reset(const Rigid3& world_from_camera, const Matrix6d& covariance) {
  motion_ = KollerMotion();
  motion_.camera_from_world = world_from_camera.Inverse();
  const Matrix6d by = FromCameraPose(motion_.camera_from_world);
  p_.setZero();
  p_.topLeftCorner<6, 6>() = by * covariance * by.transpose();
  p_.diagonal().segment<3>(6).setConstant(kSpeed_m_s * kSpeed_m_s);
  p_.diagonal().segment<3>(9).setConstant(kTurn_rad_s * kTurn_rad_s);
  p_.diagonal().segment<3>(12).setConstant(kAcceleration_m_s2 * kAcceleration_m_s2);
}

void LandmarkFilter::Predict(double dt, const KollerNoise& noise) {
  const double whole = std::clamp(dt, 0.0, 1.0);
  const int steps = std::max(1, static_cast<int>(std::ceil(whole / kLongestStep_s - 0.1)));
  for (int k = 0; k < steps; ++k) {
    const KollerJacobians by = LineariseKoller(motion_, whole / steps, noise);
    p_ = by.f * p_ * by.f.transpose() + by.q;
    motion_ = PropagateKoller(motion_, whole / steps);
  }
}

std::optional<PredictedPixel> LandmarkFilter::Predicted(
    const CameraModel& camera, const Eigen::Vector3d& point_in_world) const {
  const auto at = PredictFixed(camera, WorldFromCamera(), point_in_world);
  if (!at) return std::nullopt;
  const Eigen::Matrix<double, 2, 6> hp = at->d_camera * PoseCovariance();
  return PredictedPixel{*at, hp * at->d_camera.transpose(), hp};
}

Matrix6d LandmarkFilter::PoseCovariance() const {
  const Matrix6d by = ToCameraPose(motion_.camera_from_world);
  return by * p_.topLeftCorner<6, 6>() * by.transpose();
}

absl::StatusOr<UpdateReport> LandmarkFilter::Update(const CameraModel& camera,
                                                    std::span<const KnownSight> seen,
                                                    int iterations) {
  UpdateReport report;
  if (seen.empty()) return report;
  const Eigen::LLT<Matrix15d> prior(p_);
  if (prior.info() != Eigen::Success) {
    return absl::FailedPreconditionError("landmarks: covariance not positive definite");
  }
  const Matrix15d before = prior.solve(Matrix15d::Identity());
  const KollerMotion predicted = motion_;
  KollerMotion at = motion_;
  Vector15d step = Vector15d::Zero();
  Matrix15d posterior;
  for (int k = 0; k < std::max(1, iterations); ++k) {
    Matrix15d information = before;
    Vector15d pulled = Vector15d::Zero();
    const Matrix6d to_pose = ToCameraPose(at.camera_from_world);
    // Errors are counted at the prediction, rows are made at `at`.
    Matrix15d moved = Matrix15d::Identity();
    moved.block<3, 3>(3, 3) = RightJacobianSo3(step.segment<3>(3));
    double squares = 0.0;
    for (const KnownSight& each : seen) {
      const auto pixel = PredictFixed(camera, at.camera_from_world.Inverse(), each.point_in_world);
      if (!pixel) return absl::InvalidArgumentError("landmarks: a point is not in view");
      const Eigen::LLT<Eigen::Matrix2d> noise(each.noise);
      if (noise.info() != Eigen::Success) {
        return absl::FailedPreconditionError("landmarks: noise not positive definite");
      }
      Rows h = Rows::Zero();
      h.leftCols<6>() = pixel->d_camera * to_pose;
      h = (h * moved).eval();
      const Eigen::Vector2d innovation = each.pixel - pixel->pixel + h * step;
      information += h.transpose() * noise.solve(h);
      const Eigen::Vector2d weighted = noise.solve(innovation);
      pulled += h.transpose() * weighted;
      squares += innovation.dot(weighted);
    }
    const Eigen::LLT<Matrix15d> factor(information);
    if (factor.info() != Eigen::Success) {
      return absl::FailedPreconditionError("landmarks: information not positive definite");
    }
    posterior = factor.solve(Matrix15d::Identity());
    step = posterior * pulled;
    if (!step.allFinite()) return absl::FailedPreconditionError("landmarks: update not finite");
    report.nis = squares - pulled.dot(step);
    at = Plus(predicted, step);
  }
  report.rows = 2 * static_cast<int>(seen.size());
  motion_ = at;
  Matrix15d carry = Matrix15d::Identity();
  carry.block<3, 3>(3, 3) = RightJacobianSo3(step.segment<3>(3));
  p_ = carry * posterior * carry.transpose();
  p_ = (0.5 * (p_ + p_.transpose())).eval();
  return report;
}

}  // namespace saccade
