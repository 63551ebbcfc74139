#include "server/features/pose_fit.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "shared/geometry/so3.hpp"

namespace saccade {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A point that the lens cannot see counts as this far away [px].
constexpr double kUnseenPx = 300.0;

double HuberCost(double error, double knee) {
  return error <= knee ? error * error : 2.0 * knee * error - knee * knee;
}

/// Sum of squared residuals [px^2], robust and with the prior; normal equations on request.
class Problem {
 public:
  Problem(const CameraModel& camera, std::span<const Eigen::Vector3d> points,
          std::span<const Eigen::Vector2d> pixels, const Rigid3& prior,
          const PoseFitOptions& options)
      : camera_(camera), points_(points), pixels_(pixels), prior_(prior), options_(options) {
    const double s = options.sigma_px;
    if (options.prior_position_sigma_m > 0) {
      position_weight_ = s * s / std::pow(options.prior_position_sigma_m, 2);
    }
    if (options.prior_orientation_sigma_rad > 0) {
      orientation_weight_ = s * s / std::pow(options.prior_orientation_sigma_rad, 2);
    }
  }

  double Cost(const Rigid3& pose, Matrix6d* hessian = nullptr, Vector6d* gradient = nullptr) const {
    const Eigen::Vector3d shift = pose.translation - prior_.translation;
    const Eigen::Vector3d turn = LogQuaternion(prior_.rotation.conjugate() * pose.rotation);
    double cost = position_weight_ * shift.squaredNorm() + orientation_weight_ * turn.squaredNorm();
    if (hessian != nullptr) {
      hessian->setZero();
      hessian->diagonal().head<3>().setConstant(position_weight_);
      hessian->diagonal().tail<3>().setConstant(orientation_weight_);
      for (int k = 0; k < 3; ++k) {
        (*gradient)[k] = position_weight_ * shift[k];
        (*gradient)[k + 3] = orientation_weight_ * turn[k];
      }
    }
    const Eigen::Matrix3d camera_from_world = pose.RotationMatrix().transpose();
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const Eigen::Vector3d point = camera_from_world * (points_[k] - pose.translation);
      Eigen::Matrix<double, 2, 3> by_point;
      const auto seen = camera_.Project(point, &by_point);
      if (!seen) {
        cost += HuberCost(kUnseenPx, options_.huber_px);
        continue;
      }
      const Eigen::Vector2d error = *seen - pixels_[k];
      const double length = error.norm();
      cost += HuberCost(length, options_.huber_px);
      if (hessian == nullptr) continue;
      const double weight = length <= options_.huber_px ? 1.0 : options_.huber_px / length;
      Eigen::Matrix<double, 2, 6> jacobian;
      jacobian << -by_point * camera_from_world, by_point * Skew(point);
      *hessian += weight * jacobian.transpose() * jacobian;
      *gradient += weight * jacobian.transpose() * error;
    }
    return cost;
  }

 private:
  const CameraModel& camera_;
  std::span<const Eigen::Vector3d> points_;
  std::span<const Eigen::Vector2d> pixels_;
  const Rigid3& prior_;
  const PoseFitOptions& options_;
  double position_weight_ = 0, orientation_weight_ = 0;
};

absl::Status CheckInput(std::span<const Eigen::Vector3d> points,
                        std::span<const Eigen::Vector2d> pixels, std::size_t least) {
  if (points.size() != pixels.size() || points.size() < least) {
    return absl::InvalidArgumentError(absl::StrCat("pose fit: ", points.size(), " points and ",
                                                   pixels.size(), " pixels; give at least ", least,
                                                   " of each, equally many"));
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!points[k].allFinite() || !pixels[k].allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("pose fit: point ", k, " is not finite"));
    }
  }
  return absl::OkStatus();
}

double Rms(const CameraModel& camera, std::span<const Eigen::Vector3d> points,
           std::span<const Eigen::Vector2d> pixels, const Rigid3& pose) {
  const Rigid3 camera_from_world = pose.Inverse();
  double squared = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto seen = camera.Project(camera_from_world * points[k]);
    squared += seen ? (*seen - pixels[k]).squaredNorm() : kUnseenPx * kUnseenPx;
  }
  return std::sqrt(squared / static_cast<double>(points.size()));
}

/// OpenCV's camera_from_world (rotation vector, translation) as world_from_camera.
Rigid3 FromOpenCv(const cv::Mat& rotation, const cv::Mat& translation) {
  const auto vector = [](const cv::Mat& m) {
    return Eigen::Vector3d(m.at<double>(0), m.at<double>(1), m.at<double>(2));
  };
  return Rigid3{ExpQuaternion(vector(rotation)), vector(translation)}.Inverse();
}

}  // namespace

absl::StatusOr<PoseFit> FitPose(const CameraModel& camera,
                                std::span<const Eigen::Vector3d> points_in_world,
                                std::span<const Eigen::Vector2d> pixels, const Rigid3& initial,
                                const PoseFitOptions& options) {
  if (absl::Status status = CheckInput(points_in_world, pixels, 3); !status.ok()) return status;
  if (!initial.translation.allFinite() || !initial.rotation.coeffs().allFinite()) {
    return absl::InvalidArgumentError("pose fit: the initial pose is not finite");
  }
  const Problem problem(camera, points_in_world, pixels, initial, options);
  Rigid3 pose = initial;
  Matrix6d hessian;
  Vector6d gradient;
  double cost = problem.Cost(pose, &hessian, &gradient);
  double damping = 1e-4;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    Matrix6d damped = hessian;
    damped.diagonal() += damping * hessian.diagonal() + Vector6d::Constant(1e-12);
    const Vector6d step = -damped.ldlt().solve(gradient);
    if (!step.allFinite()) return absl::FailedPreconditionError("pose fit: singular");
    const Rigid3 trial{(pose.rotation * ExpQuaternion(step.tail<3>())).normalized(),
                       pose.translation + step.head<3>()};
    const double trial_cost = problem.Cost(trial);
    if (trial_cost <= cost) {
      pose = trial;
      damping = std::max(1e-9, damping * 0.2);
      const bool done = cost - trial_cost < 1e-10 * (1.0 + cost) && step.norm() < 1e-8;
      cost = problem.Cost(pose, &hessian, &gradient);
      if (done) break;
    } else {
      damping *= 10.0;
      if (damping > 1e8) break;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(hessian);
  if (!(eigen.eigenvalues()[0] > 1e-9 * eigen.eigenvalues()[5])) {
    return absl::FailedPreconditionError(
        "pose fit: the points do not determine the pose (too few, or on a line)");
  }
  PoseFit fit;
  fit.world_from_camera = pose;
  fit.rms_px = Rms(camera, points_in_world, pixels, pose);
  if (fit.rms_px >= 0.3 * kUnseenPx) {
    return absl::FailedPreconditionError("pose fit: points lie behind the camera");
  }
  const double freedom = 2.0 * static_cast<double>(points_in_world.size()) - 6.0;
  const double found = freedom > 0 ? cost / freedom : 0.0;
  const double variance = std::max(options.sigma_px * options.sigma_px, found);
  fit.covariance = variance * hessian.ldlt().solve(Matrix6d::Identity());
  return fit;
}

absl::StatusOr<std::vector<PoseFit>> FitPlanarPose(const CameraModel& camera,
                                                   std::span<const Eigen::Vector3d> points_in_world,
                                                   std::span<const Eigen::Vector2d> pixels,
                                                   const PoseFitOptions& options) {
  if (absl::Status status = CheckInput(points_in_world, pixels, 4); !status.ok()) return status;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (std::size_t k = 0; k < points_in_world.size(); ++k) {
    const Eigen::Vector3d& point = points_in_world[k];
    if (std::abs(point.z()) > 1e-9) {
      return absl::InvalidArgumentError(
          absl::StrCat("planar pose: point ", k, " is not in the plane z = 0"));
    }
    const auto ray = camera.Unproject(pixels[k]);
    if (!ray || ray->z() < 0.05) continue;  // no finite point in the image plane of a pinhole
    points.emplace_back(point.x(), point.y(), 0.0);
    rays.emplace_back(ray->x() / ray->z(), ray->y() / ray->z());
  }
  if (points.size() < 4) return absl::FailedPreconditionError("planar pose: too wide a view");
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::solvePnPGeneric(points, rays, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations,
                        translations, false, cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception& error) {
    return absl::FailedPreconditionError(absl::StrCat("planar pose: ", error.err));
  }
  std::vector<PoseFit> fits;
  for (std::size_t k = 0; k < rotations.size(); ++k) {
    const Rigid3 initial = FromOpenCv(rotations[k], translations[k]);
    if (!initial.translation.allFinite()) continue;
    auto fit = FitPose(camera, points_in_world, pixels, initial, options);
    if (fit.ok()) fits.push_back(*fit);
  }
  if (fits.empty()) return absl::FailedPreconditionError("planar pose: degenerate points");
  std::sort(fits.begin(), fits.end(),
            [](const PoseFit& a, const PoseFit& b) { return a.rms_px < b.rms_px; });
  return fits;
}

}  // namespace saccade
