#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <random>

#include "server/features/pose_fit.hpp"
#include "shared/geometry/so3.hpp"

namespace saccade {
namespace {

struct PoseSample {
  int index = 0;
  Eigen::Vector3d point;    // [m, world]
  Eigen::Vector3d bearing;  // unit, camera
};

Eigen::Vector3d ToEigen(const cv::Mat& m) {
  return {m.at<double>(0), m.at<double>(1), m.at<double>(2)};
}

/// camera_from_world hypotheses of three samples, up to four.
std::vector<Rigid3> SolveP3p(const std::array<const PoseSample*, 3>& samples) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const PoseSample* sample : samples) {
    points.emplace_back(sample->point.x(), sample->point.y(), sample->point.z());
    rays.emplace_back(sample->bearing.x() / sample->bearing.z(),
                      sample->bearing.y() / sample->bearing.z());
  }
  std::vector<Rigid3> poses;
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::solveP3P(points, rays, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations, translations,
                 cv::SOLVEPNP_AP3P);
  } catch (const cv::Exception&) {
    return poses;  // degenerate triple
  }
  for (std::size_t k = 0; k < rotations.size(); ++k) {
    const Rigid3 pose{ExpQuaternion(ToEigen(rotations[k])), ToEigen(translations[k])};
    if (pose.translation.allFinite() && pose.rotation.coeffs().allFinite()) poses.push_back(pose);
  }
  return poses;
}

int CountInliers(const std::vector<PoseSample>& samples, const Rigid3& camera_from_world,
                 double cosine) {
  const Eigen::Matrix3d rotation = camera_from_world.RotationMatrix();
  int count = 0;
  for (const PoseSample& sample : samples) {
    const Eigen::Vector3d point = rotation * sample.point + camera_from_world.translation;
    const double along = point.dot(sample.bearing);
    count += along > 0 && along * along > cosine * cosine * point.squaredNorm() ? 1 : 0;
  }
  return count;
}

std::vector<int> Inliers(const CameraModel& camera, std::span<const Eigen::Vector3d> points,
                         std::span<const Eigen::Vector2d> pixels, const Rigid3& world_from_camera,
                         double limit_px) {
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  std::vector<int> inliers;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto seen = camera.Project(camera_from_world * points[k]);
    if (seen && (*seen - pixels[k]).norm() < limit_px) inliers.push_back(static_cast<int>(k));
  }
  return inliers;
}

/// Fits to the inliers and chooses them again until they stay.
absl::StatusOr<RansacPose> Polish(const CameraModel& camera,
                                  std::span<const Eigen::Vector3d> points,
                                  std::span<const Eigen::Vector2d> pixels, const Rigid3& initial,
                                  const RansacOptions& options) {
  RansacPose result;
  result.fit.world_from_camera = initial;
  // The hypothesis of three noisy points is rough: collect wider at first.
  std::vector<int> inliers = Inliers(camera, points, pixels, initial, 2.0 * options.inlier_px);
  for (int round = 0; round < 6; ++round) {
    if (static_cast<int>(inliers.size()) < options.min_inliers) break;
    std::vector<Eigen::Vector3d> used_points;
    std::vector<Eigen::Vector2d> used_pixels;
    for (const int k : inliers) {
      used_points.push_back(points[k]);
      used_pixels.push_back(pixels[k]);
    }
    auto fit = FitPose(camera, used_points, used_pixels, result.fit.world_from_camera,
                       {.sigma_px = 1.0, .huber_px = 0.5 * options.inlier_px});
    if (!fit.ok()) return fit.status();
    result.fit = *fit;
    std::vector<int> next =
        Inliers(camera, points, pixels, fit->world_from_camera, options.inlier_px);
    const bool same = next == inliers;
    inliers = std::move(next);
    if (same) break;
  }
  if (static_cast<int>(inliers.size()) < options.min_inliers) {
    return absl::NotFoundError(
        absl::StrCat("pose: ", inliers.size(), " inliers, ", options.min_inliers, " needed"));
  }
  result.inliers = std::move(inliers);
  return result;
}

}  // namespace

absl::StatusOr<RansacPose> FitPoseRansac(const CameraModel& camera,
                                         std::span<const Eigen::Vector3d> points_in_world,
                                         std::span<const Eigen::Vector2d> pixels,
                                         const RansacOptions& options) {
  if (points_in_world.size() != pixels.size()) {
    return absl::InvalidArgumentError("pose: as many points as pixels are needed");
  }
  std::vector<PoseSample> samples;
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    if (!points_in_world[k].allFinite() || !pixels[k].allFinite()) continue;
    const auto ray = camera.Unproject(pixels[k]);
    if (ray && ray->z() > 0.05) {
      samples.push_back({static_cast<int>(k), points_in_world[k], *ray});
    }
  }
  const int count = static_cast<int>(samples.size());
  if (count < std::max(4, options.min_inliers)) {
    return absl::NotFoundError(absl::StrCat("pose: only ", count, " correspondences"));
  }
  const double cosine = std::cos(1.5 * options.inlier_px * camera.RadiansPerPixel());
  std::mt19937_64 random(options.seed);
  Rigid3 best;
  int best_count = 0;
  double needed = options.max_iterations;
  for (int iteration = 0; iteration < options.max_iterations && iteration < needed; ++iteration) {
    const auto draw = [&] { return static_cast<int>(random() % static_cast<unsigned>(count)); };
    const int a = draw(), b = draw(), c = draw();
    if (a == b || b == c || a == c) continue;
    for (const Rigid3& pose : SolveP3p({&samples[a], &samples[b], &samples[c]})) {
      const int inliers = CountInliers(samples, pose, cosine);
      if (inliers <= best_count) continue;
      best_count = inliers;
      best = pose;
      const double all_good = std::pow(static_cast<double>(inliers) / count, 3);
      needed = all_good > 0.999 ? 3 : std::log(1 - options.confidence) / std::log1p(-all_good);
    }
  }
  // Half of the wanted support is enough to try: the fit below finds the rest or refuses.
  if (best_count < std::max(4, options.min_inliers / 2)) {
    return absl::NotFoundError(absl::StrCat("pose: at most ", best_count, " of ", count, " agree"));
  }
  return Polish(camera, points_in_world, pixels, best.Inverse(), options);
}

}  // namespace saccade
