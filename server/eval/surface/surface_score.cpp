#include "server/eval/surface/surface_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace saccade {
namespace {

constexpr double kGood_m = 0.03, kGoodShare = 0.03;
constexpr double kBefore_m = 0.10;
constexpr std::size_t kMostCorners = 20'000;
constexpr std::size_t kMostViews = 16;
constexpr int kCoverStride = 8;  // pixels
constexpr double kTwoPlaces_rad = 0.04;
constexpr int kDirections = 26;

/// One kept view, estimated and true.
struct TrueView {
  FrameId frame = 0;
  Rigid3 estimated, truth;
  Pinhole camera;
};

double Tolerance(double distance) { return std::max(kGood_m, kGoodShare * distance); }

class Scorer {
 public:
  Scorer(const SimSource& truth, const SurfaceMap& surfaces, const WholeMesh& mesh, bool metric)
      : truth_(truth), mesh_(mesh) {
    double gone = 0, true_gone = 0;
    for (const SurfaceMap::KeptView& view : surfaces.views()) {
      views_.push_back({view.frame, view.world_from_camera, truth.WorldFromCamera(view.frame),
                        view.picture->camera});
      if (views_.size() < 2) continue;
      const TrueView &a = views_[views_.size() - 2], &b = views_.back();
      gone += (a.estimated.translation - b.estimated.translation).norm();
      true_gone += (a.truth.translation - b.truth.translation).norm();
    }
    if (!metric && gone > 0) scale_ = true_gone / gone;
    for (std::size_t k = 0; k < views_.size(); ++k) {
      if (k * kMostViews / views_.size() != (k + 1) * kMostViews / views_.size()) {
        chosen_.push_back(views_[k]);
      }
    }
  }

  void Corners(nlohmann::ordered_json& report) {
    const std::size_t step = 1 + mesh_.points.size() / kMostCorners;
    std::size_t good = 0, all = 0;
    std::vector<double> shares;  // of the distance
    for (std::size_t i = 0; i < mesh_.points.size(); i += step) {
      const TrueView* nearest = nullptr;
      double distance = std::numeric_limits<double>::max();
      Eigen::Vector3d in_camera = Eigen::Vector3d::Zero();
      for (const TrueView& view : views_) {
        const Eigen::Vector3d point = view.estimated.Inverse() * mesh_.points[i].cast<double>();
        if (point.z() <= 0.0 || point.norm() >= distance || !InView(view.camera, point)) continue;
        nearest = &view;
        distance = point.norm();
        in_camera = scale_ * point;
      }
      if (nearest == nullptr) continue;
      const double off = FromSurface(*nearest, in_camera, mesh_.normals[i].cast<double>());
      good += off <= Tolerance(in_camera.norm()) ? 1 : 0;
      shares.push_back(off / in_camera.norm());
      ++all;
    }
    report["points"] = all;
    report["points_good"] = all > 0 ? static_cast<double>(good) / static_cast<double>(all) : 0.0;
    if (shares.empty()) return;
    std::sort(shares.begin(), shares.end());
    report["off_share_p50"] = shares[shares.size() / 2];
    report["off_share_p90"] = shares[shares.size() * 9 / 10];
  }

  void Views(nlohmann::ordered_json& report) {
    std::size_t seen = 0, covered = 0, drawn = 0, before = 0, wrong = 0;
    for (const TrueView& view : chosen_) {
      const cv::Mat truth = TrueDepth(view);
      cv::Mat depth = DrawMesh(mesh_, view.camera, view.estimated).depth;
      depth *= scale_;
      for (int y = 1; y + 1 < truth.rows; ++y) {
        for (int x = 1; x + 1 < truth.cols; ++x) {
          const float z = depth.at<float>(y, x);
          if (z > 0.0f) {
            ++drawn;
            const double nearest = Nearest(truth, x, y);
            before += z < nearest - kBefore_m ? 1 : 0;
            wrong += z < nearest - Tolerance(nearest) ? 1 : 0;
          }
          if (x % kCoverStride != 0 || y % kCoverStride != 0 || truth.at<float>(y, x) <= 0.0f) {
            continue;
          }
          const Eigen::Vector3d point = truth.at<float>(y, x) * Ray(view.camera, x, y);
          if (!FromTwoPlaces(view.truth * point)) continue;
          ++seen;
          covered += Shows(view.camera, depth, x, y, point) ? 1 : 0;
        }
      }
    }
    const auto share = [](std::size_t part, std::size_t whole) {
      return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
    };
    report["seen_from_two"] = seen;
    report["covered"] = share(covered, seen);
    report["pixels"] = drawn;
    report["false_before"] = share(before, drawn);
    report["before_by_tolerance"] = share(wrong, drawn);
    report["scale"] = scale_;
  }

 private:
  static Eigen::Vector3d Ray(const Pinhole& camera, int x, int y) {
    return camera.Ray(static_cast<float>(x), static_cast<float>(y)).cast<double>();
  }
  static bool InView(const Pinhole& camera, const Eigen::Vector3d& point) {
    const double u = camera.focal_px * point.x() / point.z() + camera.cx;
    const double v = camera.focal_px * point.y() / point.z() + camera.cy;
    return u >= 0 && v >= 0 && u <= camera.width - 1 && v <= camera.height - 1;
  }

  /// At most how far a point of a view's camera is from a true surface [m].
  double FromSurface(const TrueView& view, const Eigen::Vector3d& in_camera,
                     const Eigen::Vector3d& normal) const {
    const Eigen::Vector3d point = view.truth * in_camera;
    double least = std::numeric_limits<double>::max();
    const auto look = [&](const Eigen::Vector3d& direction) {
      if (const auto hit = truth_.SurfaceAlong(point, direction)) least = std::min(least, *hit);
    };
    const Eigen::Vector3d line = point - view.truth.translation;
    if (const auto hit = truth_.SurfaceAlong(view.truth.translation, line.normalized())) {
      least = std::abs(*hit - line.norm());
    }
    const Eigen::Vector3d turned =
        view.truth.rotation * (view.estimated.rotation.conjugate() * normal);
    if (turned.norm() > 0.5) {
      look(turned.normalized());
      look(-turned.normalized());
    }
    for (int k = 0; k < kDirections; ++k) {
      const int cell = k < kDirections / 2 ? k : k + 1;  // without the middle of 3x3x3
      look(Eigen::Vector3d(cell % 3 - 1, cell / 3 % 3 - 1, cell / 9 - 1).normalized());
    }
    return least;
  }

  /// CV_32FC1, along the optic axis; 0 where nothing is.
  cv::Mat TrueDepth(const TrueView& view) const {
    cv::Mat depth = cv::Mat::zeros(view.camera.height, view.camera.width, CV_32F);
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        const Eigen::Vector3d ray = Ray(view.camera, x, y);
        const auto hit =
            truth_.SurfaceAlong(view.truth.translation, view.truth.rotation * ray.normalized());
        if (hit) depth.at<float>(y, x) = static_cast<float>(*hit / ray.norm());
      }
    }
    return depth;
  }

  static double Nearest(const cv::Mat& depth, int x, int y) {
    double nearest = std::numeric_limits<double>::max();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const float z = depth.at<float>(y + dy, x + dx);
        if (z > 0.0f) nearest = std::min(nearest, static_cast<double>(z));
      }
    }
    return nearest;
  }

  bool FromTwoPlaces(const Eigen::Vector3d& point) const {
    std::optional<Eigen::Vector3d> first;
    for (const TrueView& view : views_) {
      if (!truth_.Visible(view.frame, point)) continue;
      const Eigen::Vector3d ray = (point - view.truth.translation).normalized();
      if (!first) first = ray;
      if (first->cross(ray).norm() > kTwoPlaces_rad) return true;
    }
    return false;
  }

  static bool Shows(const Pinhole& camera, const cv::Mat& depth, int x, int y,
                    const Eigen::Vector3d& point) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const float z = depth.at<float>(y + dy, x + dx);
        if (z > 0.0f &&
            (z * Ray(camera, x + dx, y + dy) - point).norm() <= Tolerance(point.norm())) {
          return true;
        }
      }
    }
    return false;
  }

  const SimSource& truth_;
  const WholeMesh& mesh_;
  std::vector<TrueView> views_, chosen_;
  double scale_ = 1.0;  // metres in the map's unit
};

}  // namespace

nlohmann::ordered_json ScoreSurface(const SimSource& truth, const SurfaceMap& surfaces,
                                    const WholeMesh& mesh, bool metric) {
  nlohmann::ordered_json report;
  Scorer scorer(truth, surfaces, mesh, metric);
  scorer.Corners(report);
  scorer.Views(report);
  return report;
}

}  // namespace saccade
