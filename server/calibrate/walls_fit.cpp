#include "server/calibrate/walls_fit.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <Eigen/Dense>
#include <cmath>
#include <iostream>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "server/markers/marker_detector.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLeastSquares = 2;
constexpr double kLeastDepth = 0.02;  // of what one view shows, off a plane, against its spread
constexpr double kMostRms_px = 3.0;

/// Centre and spread taken out: DLT is badly conditioned otherwise (Hartley 1997).
template <int N>
Eigen::Matrix<double, N + 1, N + 1> Normalising(
    const std::vector<Eigen::Matrix<double, N, 1>>& all) {
  Eigen::Matrix<double, N, 1> mean = Eigen::Matrix<double, N, 1>::Zero();
  for (const auto& each : all) mean += each / static_cast<double>(all.size());
  double spread = 0.0;
  for (const auto& each : all) spread += (each - mean).norm() / static_cast<double>(all.size());
  Eigen::Matrix<double, N + 1, N + 1> t = Eigen::Matrix<double, N + 1, N + 1>::Identity();
  const double scale = std::sqrt(static_cast<double>(N)) / std::max(1e-12, spread);
  t.template topLeftCorner<N, N>() *= scale;
  t.template topRightCorner<N, 1>() = -scale * mean;
  return t;
}

/// [fx, fy, cx, cy] of the projection matrix that fits best; nothing where it is none of a camera.
std::optional<Eigen::Vector4d> Dlt(const WallsView& view) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (std::size_t k = 0; k < view.points.size(); ++k) {
    points.emplace_back(view.points[k].x, view.points[k].y, view.points[k].z);
    pixels.emplace_back(view.pixels[k].x, view.pixels[k].y);
  }
  const Eigen::Matrix4d of_points = Normalising<3>(points);
  const Eigen::Matrix3d of_pixels = Normalising<2>(pixels);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * std::ssize(points), 12);
  for (Eigen::Index k = 0; k < std::ssize(points); ++k) {
    const Eigen::Vector4d x = of_points * points[static_cast<std::size_t>(k)].homogeneous();
    const Eigen::Vector3d u = of_pixels * pixels[static_cast<std::size_t>(k)].homogeneous();
    a.block<1, 4>(2 * k, 0) = x.transpose();
    a.block<1, 4>(2 * k, 8) = -u.x() * x.transpose();
    a.block<1, 4>(2 * k + 1, 4) = x.transpose();
    a.block<1, 4>(2 * k + 1, 8) = -u.y() * x.transpose();
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a, Eigen::ComputeFullV);
  const Eigen::Matrix<double, 12, 1> p = svd.matrixV().col(11);
  const Eigen::Matrix<double, 3, 4> normal =
      Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(p.data());
  const Eigen::Matrix<double, 3, 4> projection = of_pixels.inverse() * normal * of_points;
  cv::Matx33d m, k, r;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) m(row, column) = projection(row, column);
  }
  cv::RQDecomp3x3(m, k, r);
  if (std::abs(k(2, 2)) < 1e-12) return std::nullopt;
  const Eigen::Vector4d lens(std::abs(k(0, 0) / k(2, 2)), std::abs(k(1, 1) / k(2, 2)),
                             k(0, 2) / k(2, 2), k(1, 2) / k(2, 2));
  if (!lens.allFinite() || lens[0] < 1.0 || lens[1] < 1.0) return std::nullopt;
  return lens;
}

double DepthOf(const WallsView& view) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  const auto at = [](const cv::Point3f& p) { return Eigen::Vector3d(p.x, p.y, p.z); };
  for (const cv::Point3f& p : view.points) mean += at(p) / static_cast<double>(view.points.size());
  for (const cv::Point3f& p : view.points) spread += (at(p) - mean) * (at(p) - mean).transpose();
  const Eigen::Vector3d along =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
  return std::sqrt(std::max(0.0, along[0]) / along[2]);
}

/// The views that are of use.
absl::StatusOr<std::vector<WallsView>> SeeWalls(const PictureSet& pictures,
                                                const WallSquares& walls, int border_bits,
                                                cv::Size& size) {
  const char* name = absl::StartsWith(walls.family, "apriltag") ? "apriltag" : "aruco";
  const auto detector = MakeMarkerDetector(name, {{walls.family}, std::max(1, border_bits)});
  if (!detector.ok()) return detector.status();
  std::vector<WallsView> views;
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const absl::StatusOr<cv::Mat> grey = pictures.load(k);
    const auto leave = [&](absl::string_view why) {
      std::cerr << "left out: " << pictures.names[k] << ": " << why << "\n";
    };
    if (!grey.ok()) {
      leave(grey.status().message());
      continue;
    }
    if (size.empty()) size = grey->size();
    if (grey->size() != size) {
      leave("is of another size than those before");
      continue;
    }
    WallsView view{pictures.names[k], {}, {}, 0};
    std::size_t squares = 0;
    for (const MarkerSighting& sighting : (*detector)->Detect(*grey)) {
      if (!walls.squares.contains(sighting.id)) continue;
      ++squares;
      const auto corners = walls.Corners(sighting.id);
      for (std::size_t c = 0; c < corners.size(); ++c) {
        view.points.emplace_back(corners[c].x(), corners[c].y(), corners[c].z());
        view.pixels.emplace_back(sighting.corners[c].x(), sighting.corners[c].y());
      }
    }
    if (squares < kLeastSquares || DepthOf(view) < kLeastDepth) {
      leave("shows no squares on both walls");
    } else {
      views.push_back(std::move(view));
    }
  }
  return views;
}

struct Fitted {
  double rms_px = 0;
  cv::Matx33d camera;
  cv::Mat distortion, sigmas, errors;
};

Fitted Refine(const std::vector<WallsView>& views, cv::Size size, const cv::Matx33d& start,
              bool with_k1) {
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const WallsView& view : views) {
    points.push_back(view.points);
    pixels.push_back(view.pixels);
  }
  Fitted fitted;
  fitted.camera = start;
  fitted.distortion = cv::Mat::zeros(1, 5, CV_64F);
  int flags = cv::CALIB_USE_INTRINSIC_GUESS | cv::CALIB_FIX_ASPECT_RATIO |
              cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3;
  if (!with_k1) flags |= cv::CALIB_FIX_K1;
  cv::Mat camera(fitted.camera, /*copyData=*/true), poses;
  std::vector<cv::Mat> rotations, translations;
  fitted.rms_px = cv::calibrateCamera(
      points, pixels, size, camera, fitted.distortion, rotations, translations, fitted.sigmas,
      poses, fitted.errors, flags,
      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-12));
  fitted.camera = camera;
  return fitted;
}

}  // namespace

absl::StatusOr<WallsFit> FitWalls(const PictureSet& pictures, const WallSquares& walls,
                                  int border_bits) {
  cv::Size size;
  absl::StatusOr<std::vector<WallsView>> views = SeeWalls(pictures, walls, border_bits, size);
  if (!views.ok()) return views.status();
  std::optional<Eigen::Vector4d> start;
  std::size_t most = 0, corners = 0;
  for (const WallsView& view : *views) {
    corners += view.pixels.size();
    const auto lens = Dlt(view);
    if (!lens || view.pixels.size() <= most) continue;
    start = lens;
    most = view.pixels.size();
  }
  if (!start) {
    return absl::FailedPreconditionError(
        "walls: no picture shows the squares of both walls; stand so that both are in view, and "
        "check ids and family in the file");
  }
  const double focal = std::sqrt((*start)[0] * (*start)[1]);
  const bool inside =
      (*start)[2] > 0 && (*start)[2] < size.width && (*start)[3] > 0 && (*start)[3] < size.height;
  const cv::Matx33d camera(focal, 0, inside ? (*start)[2] : 0.5 * (size.width - 1), 0, focal,
                           inside ? (*start)[3] : 0.5 * (size.height - 1), 0, 0, 1);
  Fitted best;
  try {
    best = Refine(*views, size, camera, false);
    const Fitted bent = Refine(*views, size, camera, true);
    const double n = 2.0 * static_cast<double>(corners);  // Bayes' information criterion
    if (n * std::log(bent.rms_px / best.rms_px) * 2.0 + std::log(n) < 0.0) best = bent;
  } catch (const cv::Exception& error) {
    return absl::FailedPreconditionError(
        absl::StrCat("walls: no lens explains the squares (", error.what(), "); check the file"));
  }
  if (!(best.rms_px < kMostRms_px)) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "walls: the squares are %.1f px from where the file puts them; check their sides, places "
        "and orientations",
        best.rms_px));
  }
  WallsFit fit;
  fit.lens.model = LensModel::kBrownConrady;
  fit.lens.width = size.width;
  fit.lens.height = size.height;
  fit.lens.fx = best.camera(0, 0);
  fit.lens.fy = best.camera(1, 1);
  fit.lens.cx = best.camera(0, 2);
  fit.lens.cy = best.camera(1, 2);
  fit.lens.distortion[0] = best.distortion.at<double>(0);
  // OpenCV gives the sigma of fy where the ratio is held, and none of fx.
  fit.focal_sigma_px = std::max(best.sigmas.at<double>(0), best.sigmas.at<double>(1));
  fit.centre_sigma_px = std::max(best.sigmas.at<double>(2), best.sigmas.at<double>(3));
  fit.k1_sigma = fit.lens.distortion[0] != 0.0 ? best.sigmas.at<double>(4) : 0.0;
  fit.rms_px = best.rms_px;
  fit.views = *std::move(views);
  for (std::size_t k = 0; k < fit.views.size(); ++k) {
    fit.views[k].rms_px = best.errors.at<double>(static_cast<int>(k));
  }
  return fit;
}

std::string WallsText(const WallsFit& fit) {
  std::string text = absl::StrFormat(
      "focal length %.2f +- %.2f px, centre (%.2f, %.2f) +- %.2f px, k1 %.4f +- %.4f\n"
      "%d views, rms %.3f px\n",
      fit.lens.fx, fit.focal_sigma_px, fit.lens.cx, fit.lens.cy, fit.centre_sigma_px,
      fit.lens.distortion[0], fit.k1_sigma, fit.views.size(), fit.rms_px);
  for (const WallsView& view : fit.views) {
    absl::StrAppendFormat(&text, "  %s: %d corners, %.3f px\n", view.name, view.pixels.size(),
                          view.rms_px);
  }
  return text;
}

nlohmann::ordered_json WallsJson(const WallsFit& fit) {
  nlohmann::ordered_json views = nlohmann::ordered_json::array();
  for (const WallsView& view : fit.views) {
    views.push_back(
        {{"name", view.name}, {"corners", view.pixels.size()}, {"rms_px", view.rms_px}});
  }
  return {{"focal_px", fit.lens.fx},
          {"focal_sigma_px", fit.focal_sigma_px},
          {"centre_px", {fit.lens.cx, fit.lens.cy}},
          {"centre_sigma_px", fit.centre_sigma_px},
          {"k1", fit.lens.distortion[0]},
          {"k1_sigma", fit.k1_sigma},
          {"rms_px", fit.rms_px},
          {"views", views}};
}

}  // namespace saccade
