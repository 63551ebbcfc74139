// The views of the relocaliser: stored, chosen, and filled with corners.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/map/relocaliser.hpp"

namespace saccade {
namespace {

constexpr int kBorderPx = 20;
constexpr int kPartners = 4;               // views that a new one is triangulated with
constexpr double kBaseline = 0.05;         // of the distance to what is in view, at least
constexpr double kMisfit_px = 3.0;         // rms of a view's features that still define its pose
constexpr double kNear = 0.3, kFar = 3.0;  // of the distance to its features: ranges of corners

double MedianRange(const Rigid3& world_from_camera, const std::vector<ViewPoint>& points) {
  std::vector<double> ranges;
  for (const ViewPoint& point : points) {
    ranges.push_back((point.point_in_world - world_from_camera.translation).norm());
  }
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  return *middle;
}

/// Metres and radians into one number: 0.2 m count as much as 15 degrees.
double ViewDistance(const Rigid3& a, const Rigid3& b) {
  return (a.translation - b.translation).norm() / 0.2 + RotationAngle(a, b) / 0.26;
}

}  // namespace

absl::Status Relocaliser::AddView(FrameId frame, const cv::Mat& grey,
                                  const Rigid3& world_from_camera,
                                  std::span<const ViewPoint> points) {
  if (grey.type() != CV_8UC1 || grey.cols < 64 || grey.rows < 64) {
    return absl::InvalidArgumentError("view: needs an 8-bit grey picture of 64 x 64 or more");
  }
  PlaceView view;
  view.frame = frame;
  view.world_from_camera = world_from_camera;
  const cv::Rect2d inside(kBorderPx, kBorderPx, grey.cols - 2 * kBorderPx,
                          grey.rows - 2 * kBorderPx);
  std::vector<Eigen::Vector2d> pixels;
  for (const ViewPoint& point : points) {
    if (static_cast<int>(view.points.size()) == options_.max_points) break;
    if (!point.pixel.allFinite() || !point.point_in_world.allFinite() ||
        !inside.contains({point.pixel.x(), point.pixel.y()})) {
      continue;
    }
    view.points.push_back(point);
    pixels.push_back(point.pixel);
  }
  if (static_cast<int>(pixels.size()) < options_.min_inliers) {
    return absl::InvalidArgumentError(absl::StrCat(
        "view ", frame, ": ", pixels.size(), " usable points, ", options_.min_inliers, " needed"));
  }
  view.thumbnail = Thumbnail(grey);
  view.described = DescribePixels(grey, pixels);
  view.grey = grey.clone();
  views_.push_back(std::move(view));
  if (static_cast<int>(views_.size()) > options_.max_views) DropMostRedundant();
  return absl::OkStatus();
}

void Relocaliser::Load(std::vector<PlaceView> views) {
  constexpr FrameId kEarlierRun = FrameId{1} << 62;
  views_ = std::move(views);
  FrameId name = kEarlierRun;
  for (PlaceView& view : views_) {
    view.frame = name++;
    view.partners.clear();
  }
}

void Relocaliser::DropMostRedundant() {
  // The older of the two most alike; the newest stays, its points are the freshest.
  std::size_t drop = 0;
  double least = std::numeric_limits<double>::max();
  for (std::size_t a = 0; a < views_.size(); ++a) {
    for (std::size_t b = a + 1; b < views_.size(); ++b) {
      const double distance =
          ViewDistance(views_[a].world_from_camera, views_[b].world_from_camera);
      if (distance < least) {
        least = distance;
        drop = a;
      }
    }
  }
  views_.erase(views_.begin() + static_cast<std::ptrdiff_t>(drop));
}

bool Relocaliser::NeedsView(const Rigid3& world_from_camera, double min_distance_m,
                            double min_angle_rad) const {
  return std::none_of(views_.begin(), views_.end(), [&](const PlaceView& k) {
    return (k.world_from_camera.translation - world_from_camera.translation).norm() <
               min_distance_m &&
           RotationAngle(k.world_from_camera, world_from_camera) < min_angle_rad;
  });
}

Relocaliser::PlaceView* Relocaliser::Find(FrameId frame) {
  const auto at = std::find_if(views_.begin(), views_.end(),
                               [frame](const PlaceView& k) { return k.frame == frame; });
  return at == views_.end() ? nullptr : &*at;
}

bool Relocaliser::Densify(const CameraModel& camera, const PointLookup& lookup) {
  for (PlaceView& view : views_) {
    if (!view.grey.empty()) {
      std::vector<Eigen::Vector2d> taken;
      for (const DescribedPoint& point : view.described) taken.push_back(point.pixel);
      view.corners = DescribeCorners(view.grey, camera, taken, options_.scene_corners);
      view.grey.release();
      ChoosePartners(view);
      return true;
    }
    if (view.partners.empty()) continue;
    PlaceView* partner = Find(view.partners.back());
    view.partners.pop_back();
    if (partner == nullptr) continue;
    const auto here = PoseNow(view, camera, lookup);
    const auto there = PoseNow(*partner, camera, lookup);
    if (!here || !there) return true;
    const double range = MedianRange(view.world_from_camera, view.points);
    TriangulateCorners(camera, {*here, &view.corners}, {*there, &partner->corners}, kNear * range,
                       kFar * range);
    return true;
  }
  return false;
}

void Relocaliser::Move(const std::function<std::optional<Similarity3>(FeatureId)>& moved) {
  for (PlaceView& view : views_) {
    std::optional<Similarity3> of_view;
    for (ViewPoint& point : view.points) {
      const std::optional<Similarity3> by = moved(point.id);
      if (!by) continue;
      point.point_in_world = *by * point.point_in_world;
      if (!of_view) of_view = by;
    }
    if (!of_view) continue;
    view.world_from_camera = of_view->Move(view.world_from_camera);
    for (double& range : view.corners.ranges_m) range *= of_view->scale;
  }
}

void Relocaliser::ChoosePartners(PlaceView& view) const {
  const double range = MedianRange(view.world_from_camera, view.points);
  std::vector<std::pair<double, FrameId>> others;
  for (const PlaceView& other : views_) {
    if (other.frame == view.frame || other.corners.described.empty()) continue;
    const double baseline =
        (other.world_from_camera.translation - view.world_from_camera.translation).norm();
    if (baseline < kBaseline * range) continue;
    others.emplace_back(
        baseline / range + RotationAngle(other.world_from_camera, view.world_from_camera),
        other.frame);
  }
  std::sort(others.begin(), others.end());
  others.resize(std::min<std::size_t>(others.size(), kPartners));
  for (const auto& [distance, frame] : others) view.partners.push_back(frame);
}

std::optional<Rigid3> Relocaliser::PoseNow(const PlaceView& view, const CameraModel& camera,
                                           const PointLookup& lookup) const {
  if (!lookup) return view.world_from_camera;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const ViewPoint& point : view.points) {
    const auto now = lookup(point.id);
    if (!now || !now->allFinite()) continue;
    points.push_back(*now);
    pixels.push_back(point.pixel);
  }
  if (points.size() < 6) return std::nullopt;
  const auto fit = FitPose(camera, points, pixels, view.world_from_camera, {.max_iterations = 8});
  if (!fit.ok() || fit->rms_px > kMisfit_px) return std::nullopt;
  return fit->world_from_camera;
}

}  // namespace saccade
