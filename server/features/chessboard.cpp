#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "server/features/target_detector.hpp"

namespace saccade {
namespace {

constexpr double kMaxRmsPx = 2.0;

/// Corners in the order of the target: entry j * columns + i.
using Grid = std::vector<cv::Point2f>;

absl::Status Check(const ImagePyramid& pyramid, const ChessboardTarget& target) {
  if (target.columns < 3 || target.rows < 3 || !(target.square_m > 0) ||
      !std::isfinite(target.square_m)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "target.yaml: chessboard of ", target.columns, " x ", target.rows, " corners, square_m ",
        target.square_m, "; give at least 3 x 3 inner corners and a positive size"));
  }
  if (pyramid.empty()) return absl::InvalidArgumentError("chessboard: no picture");
  return absl::OkStatus();
}

/// Whole board to about a pixel, in some order; empty if not seen.
Grid FindCorners(const ImagePyramid& pyramid, const cv::Size& size) {
  Grid corners;
  const int flags =
      cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  if (cv::findChessboardCorners(pyramid.level(0), size, corners, flags)) return corners;
  // Large or blurred boards: their squares join better at half resolution.
  if (cv::findChessboardCorners(pyramid.level(1), size, corners, flags)) {
    for (cv::Point2f& corner : corners) corner = {2 * corner.x + 0.5F, 2 * corner.y + 0.5F};
    return corners;
  }
  return {};
}

/// Distance between neighbouring corners where it is least [px].
double LeastSpacing(const Grid& corners, const cv::Size& size) {
  double least = std::numeric_limits<double>::max();
  for (int j = 0; j < size.height; ++j) {
    for (int i = 0; i < size.width; ++i) {
      const cv::Point2f& at = corners[j * size.width + i];
      if (i > 0) least = std::min(least, cv::norm(at - corners[j * size.width + i - 1]));
      if (j > 0) least = std::min(least, cv::norm(at - corners[(j - 1) * size.width + i]));
    }
  }
  return least;
}

Grid Reordered(const Grid& corners, const cv::Size& size, bool flip_x, bool flip_y) {
  Grid out(corners.size());
  for (int j = 0; j < size.height; ++j) {
    for (int i = 0; i < size.width; ++i) {
      const int from_i = flip_x ? size.width - 1 - i : i;
      const int from_j = flip_y ? size.height - 1 - j : j;
      out[j * size.width + i] = corners[from_j * size.width + from_i];
    }
  }
  return out;
}

/// x, y and the viewing direction are right-handed: z of the board points away from the camera.
bool SeenFromTheFront(const Grid& corners, const cv::Size& size) {
  const cv::Point2f x = corners[size.width - 1] - corners[0];
  const cv::Point2f y = corners[(size.height - 1) * size.width] - corners[0];
  return x.cross(y) > 0;
}

/// How far this order is from what is known of the orientation; less is better.
double Misfit(const Grid& corners, const CameraModel& camera, const ChessboardTarget& target,
              const std::optional<Rigid3>& predicted) {
  const auto at = [&](int i, int j) {
    const cv::Point2f& p = corners[j * target.columns + i];
    return Eigen::Vector2d(p.x, p.y);
  };
  const std::array<Eigen::Vector2d, 3> seen = {at(0, 0), at(target.columns - 1, 0),
                                               at(0, target.rows - 1)};
  if (predicted) {
    const std::array<Eigen::Vector3d, 3> points = {
        Eigen::Vector3d::Zero(), Eigen::Vector3d((target.columns - 1) * target.square_m, 0, 0),
        Eigen::Vector3d(0, (target.rows - 1) * target.square_m, 0)};
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const auto pixel = camera.Project(predicted->Inverse() * points[k]);
      sum += pixel ? (*pixel - seen[k]).norm() : 1e4;
    }
    return sum;
  }
  if (target.hint_px) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += ((*target.hint_px)[k] - seen[k]).norm();
    return sum;
  }
  return seen[0].sum();  // up and left
}

/// The two orders that a front view allows, the better one first.
Grid Oriented(const Grid& found, const CameraModel& camera, const ChessboardTarget& target,
              const std::optional<Rigid3>& predicted) {
  const cv::Size size(target.columns, target.rows);
  Grid best;
  double least = std::numeric_limits<double>::max();
  for (int k = 0; k < 4; ++k) {
    Grid order = Reordered(found, size, (k & 1) != 0, (k & 2) != 0);
    if (!SeenFromTheFront(order, size)) continue;
    const double misfit = Misfit(order, camera, target, predicted);
    if (misfit < least) {
      least = misfit;
      best = std::move(order);
    }
  }
  return best;
}

/// Corners, ordered, and the points that they are.
absl::StatusOr<TargetObservation> SeeCorners(const ImagePyramid& pyramid, const CameraModel& camera,
                                             const ChessboardTarget& target,
                                             const std::optional<Rigid3>& predicted) {
  if (absl::Status status = Check(pyramid, target); !status.ok()) return status;
  const cv::Size size(target.columns, target.rows);
  Grid corners = FindCorners(pyramid, size);
  if (corners.empty()) {
    return absl::NotFoundError(absl::StrCat("chessboard of ", target.columns, " x ", target.rows,
                                            " inner corners: not wholly in view"));
  }
  const int reach = std::clamp(static_cast<int>(0.4 * LeastSpacing(corners, size)), 2, 8);
  cv::cornerSubPix(pyramid.level(0), corners, cv::Size(reach, reach), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 0.005));
  corners = Oriented(corners, camera, target, predicted);
  if (corners.empty()) return absl::FailedPreconditionError("chessboard: corners out of order");

  TargetObservation seen;
  for (int k = 0; k < static_cast<int>(corners.size()); ++k) {
    seen.ids.push_back(k);
    seen.pixels.emplace_back(corners[k].x, corners[k].y);
    seen.points_in_world.emplace_back((k % target.columns) * target.square_m,
                                      (k / target.columns) * target.square_m, 0.0);
  }
  return seen;
}

}  // namespace

absl::StatusOr<TargetObservation> DetectChessboard(const ImagePyramid& pyramid,
                                                   const CameraModel& camera,
                                                   const ChessboardTarget& target,
                                                   const std::optional<Rigid3>& predicted) {
  absl::StatusOr<TargetObservation> corners = SeeCorners(pyramid, camera, target, predicted);
  if (!corners.ok()) return corners;
  TargetObservation& seen = *corners;
  const auto fits =
      FitPlanarPose(camera, seen.points_in_world, seen.pixels, {.sigma_px = 0.2, .huber_px = 2.0});
  if (!fits.ok()) return fits.status();
  const PoseFit* chosen = &fits->front();
  if (fits->size() > 1 && (*fits)[1].rms_px < 2.0 * chosen->rms_px &&
      RotationAngle((*fits)[1].world_from_camera, chosen->world_from_camera) > 0.02) {
    seen.ambiguous = true;
    if (predicted && RotationAngle((*fits)[1].world_from_camera, *predicted) <
                         RotationAngle(chosen->world_from_camera, *predicted)) {
      chosen = &(*fits)[1];
    }
  }
  if (chosen->rms_px > kMaxRmsPx) {
    return absl::FailedPreconditionError(
        absl::StrCat("chessboard: corners miss a plane by ", chosen->rms_px,
                     " px; check camera.yaml and the board's flatness"));
  }
  seen.world_from_camera = chosen->world_from_camera;
  seen.pose_covariance = chosen->covariance;
  seen.rms_px = chosen->rms_px;
  return corners;
}

absl::StatusOr<TargetObservation> SeeChessboard(const ImagePyramid& pyramid,
                                                const CameraModel& camera,
                                                const ChessboardTarget& target) {
  constexpr double kHuber_px = 20.0;  // distortion that the lens lacks bends the board
  absl::StatusOr<TargetObservation> seen = SeeCorners(pyramid, camera, target, std::nullopt);
  if (!seen.ok()) return seen;
  const auto fits = FitPlanarPose(camera, seen->points_in_world, seen->pixels,
                                  {.sigma_px = 0.2, .huber_px = kHuber_px});
  if (!fits.ok()) return fits.status();
  seen->world_from_camera = fits->front().world_from_camera;
  seen->rms_px = fits->front().rms_px;
  return seen;
}

}  // namespace saccade
