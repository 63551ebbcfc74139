#include "server/map/view_corners.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "server/features/corner_detector.hpp"

namespace saccade {
namespace {

constexpr double kGate_px = 2.0;    // off the epipolar line
constexpr double kMisfit_px = 1.5;  // reprojection, each picture
constexpr double kParallax_rad = 2.0 * std::numbers::pi / 180.0;
constexpr int kMaxHamming = 60;        // of 256
constexpr double kRatio = 0.8;         // best / second best on the line
constexpr double kSamePlace_px = 6.0;  // corners closer than this are no rivals of each other
constexpr double kTaken_px = 5.0;

/// Ranges of the point nearest to two rays (unit, world) from `baseline` apart.
std::optional<Eigen::Vector2d> Ranges(const Eigen::Vector3d& baseline, const Eigen::Vector3d& u,
                                      const Eigen::Vector3d& v) {
  const double along = u.dot(v);
  const double determinant = 1.0 - along * along;
  if (along < 0 || determinant < std::pow(std::sin(kParallax_rad), 2)) return std::nullopt;
  const double bu = baseline.dot(u), bv = baseline.dot(v);
  return Eigen::Vector2d(bu - along * bv, along * bu - bv) / determinant;
}

struct Pair {
  int second = -1;
  int distance = 257;
};

/// The corner of the second picture on the epipolar line of a place that looks like it, if one does
/// far more than the others. `normal` [unit, world] is of the epipolar plane.
Pair BestOnLine(const DescribedPoint& place, const Eigen::Vector3d& normal, double gate,
                const ViewCorners& second, const std::vector<Eigen::Vector3d>& rays) {
  Pair best;
  std::vector<Pair> line;
  for (std::size_t b = 0; b < rays.size(); ++b) {
    if (std::abs(rays[b].dot(normal)) > gate) continue;
    const int distance = PointDistance(place, second.described[b]);
    line.push_back({static_cast<int>(b), distance});
    if (distance < best.distance) best = line.back();
  }
  if (best.distance > kMaxHamming) return {};
  const Eigen::Vector2d& pixel = second.described[best.second].pixel;
  const bool rivalled = std::any_of(line.begin(), line.end(), [&](const Pair& other) {
    return kRatio * other.distance <= best.distance &&
           (second.described[other.second].pixel - pixel).norm() > kSamePlace_px;
  });
  return rivalled ? Pair() : best;
}

bool Fits(const CameraModel& camera, const Rigid3& world_from_camera, const Eigen::Vector3d& point,
          const Eigen::Vector2d& pixel) {
  const auto seen = camera.Project(world_from_camera.Inverse() * point);
  return seen && (*seen - pixel).norm() < kMisfit_px;
}

}  // namespace

std::vector<Eigen::Vector2d> PlacesToDescribe(const cv::Mat& grey, int count) {
  constexpr int kBorderPx = 20;
  ImagePyramid pyramid;
  if (!pyramid.Build(grey).ok()) return {};
  CornerDetector detector(
      {.min_score = 500.0, .border_px = kBorderPx, .cell_px = 12, .min_distance_px = 6.0});
  std::vector<Corner> corners;
  detector.DetectAll(pyramid, {}, count, corners);
  std::vector<Eigen::Vector2d> pixels;
  for (const Corner& corner : corners) pixels.push_back(corner.pixel);
  return pixels;
}

ViewCorners DescribeCorners(const cv::Mat& grey, const CameraModel& camera,
                            const std::vector<Eigen::Vector2d>& taken, int count) {
  ViewCorners corners;
  std::vector<Eigen::Vector2d> pixels;
  for (const Eigen::Vector2d& pixel : PlacesToDescribe(grey, count)) {
    if (std::any_of(taken.begin(), taken.end(), [&](const Eigen::Vector2d& other) {
          return (other - pixel).norm() < kTaken_px;
        })) {
      continue;
    }
    const auto ray = camera.Unproject(pixel);
    if (!ray) continue;
    pixels.push_back(pixel);
    corners.bearings.push_back(ray->normalized());
  }
  corners.described = DescribePixels(grey, pixels);
  corners.ranges_m.assign(pixels.size(), 0.0);
  return corners;
}

int TriangulateCorners(const CameraModel& camera, const CornerView& first, const CornerView& second,
                       double near_m, double far_m) {
  const Eigen::Vector3d baseline =
      second.world_from_camera.translation - first.world_from_camera.translation;
  if (baseline.norm() < near_m * kParallax_rad) return 0;
  std::vector<Eigen::Vector3d> rays;
  for (const Eigen::Vector3d& bearing : second.corners->bearings) {
    rays.push_back(second.world_from_camera.rotation * bearing);
  }
  struct Found {
    int first = -1, distance = 257;
    Eigen::Vector2d ranges = Eigen::Vector2d::Zero();
  };
  std::vector<Found> found(rays.size());  // by corner of the second
  for (std::size_t a = 0; a < first.corners->described.size(); ++a) {
    const DescribedPoint& place = first.corners->described[a];
    const Eigen::Vector3d ray = first.world_from_camera.rotation * first.corners->bearings[a];
    const Eigen::Vector3d normal = baseline.cross(ray).normalized();
    const Pair pair =
        BestOnLine(place, normal, kGate_px * camera.RadiansPerPixel(), *second.corners, rays);
    if (pair.second < 0 || pair.distance >= found[pair.second].distance) continue;
    const auto ranges = Ranges(baseline, ray, rays[pair.second]);
    if (!ranges || ranges->minCoeff() < near_m || ranges->maxCoeff() > far_m) continue;
    const Eigen::Vector3d point =
        0.5 * (first.world_from_camera.translation + (*ranges)[0] * ray +
               second.world_from_camera.translation + (*ranges)[1] * rays[pair.second]);
    if (!Fits(camera, first.world_from_camera, point, place.pixel) ||
        !Fits(camera, second.world_from_camera, point,
              second.corners->described[pair.second].pixel)) {
      continue;
    }
    found[pair.second] = {static_cast<int>(a), pair.distance, *ranges};
  }
  int agreed = 0;
  for (std::size_t b = 0; b < found.size(); ++b) {
    if (found[b].first < 0) continue;
    ++agreed;
    double& a_range = first.corners->ranges_m[found[b].first];
    if (a_range <= 0) a_range = found[b].ranges[0];
    if (second.corners->ranges_m[b] <= 0) second.corners->ranges_m[b] = found[b].ranges[1];
  }
  return agreed;
}

}  // namespace saccade
