#include "server/team/merge/keyframe_maker.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "server/features/pose_fit.hpp"

namespace saccade {
namespace {

constexpr double kKeyframeBorder_px = 20.0;
constexpr std::size_t kPartners = 4;  // views that a new one is triangulated with
constexpr double kBaseline = 0.05;    // of the distance, at least
constexpr double kMostTurned_rad = 0.6;
constexpr double kNear = 0.3, kFar = 3.0;  // of the distance: ranges of corners
constexpr double kMisfit_px = 3.0;
constexpr double kMovedShare = 0.008, kMoved_rad = 0.006;  // worth being told
constexpr double kMoreOfKeyframe = 1.2;
constexpr std::uint32_t kMatured = 5;  // frames in which a feature was measured

struct Usable {
  FeatureId id;
  Eigen::Vector2d pixel;
  double range;
};

/// Features measured in this picture whose depth is known.
std::vector<Usable> UsableIn(const Frame& frame, const MapSnapshot& snapshot) {
  std::vector<Usable> usable;
  for (const FeatureSnapshot& feature : snapshot.features) {
    if (feature.state != FeatureState::kMeasured || !feature.depth_known || !feature.pixel ||
        feature.matched_count < kMatured ||
        !frame.camera->InImage(*feature.pixel, kKeyframeBorder_px)) {
      continue;
    }
    usable.push_back({feature.id, *feature.pixel,
                      (feature.point_in_world - snapshot.world_from_camera.translation).norm()});
  }
  return usable;
}

double MedianRange(const std::vector<Usable>& usable) {
  std::vector<double> ranges;
  for (const Usable& each : usable) ranges.push_back(each.range);
  const auto middle = ranges.begin() + std::ssize(ranges) / 2;
  std::nth_element(ranges.begin(), middle, ranges.end());
  return *middle;
}

double Apart(const Rigid3& a, const Rigid3& b, double distance) {
  return (a.translation - b.translation).norm() / (0.2 * distance) + RotationAngle(a, b) / 0.26;
}

}  // namespace

bool KeyframeMaker::Wanted(const MapSnapshot& snapshot, double distance) const {
  if (views_.empty()) return true;
  if (Seconds(snapshot.capture_time_ns - views_.back().capture_time_ns) >=
      options_.at_least_every_s) {
    return true;
  }
  const Rigid3& pose = snapshot.world_from_camera;
  return std::none_of(views_.begin(), views_.end(), [&](const View& view) {
    return (view.world_from_camera.translation - pose.translation).norm() <
               options_.apart_share * distance &&
           RotationAngle(view.world_from_camera, pose) < options_.apart_rad;
  });
}

void KeyframeMaker::AddView(const Frame& frame, const MapSnapshot& snapshot) {
  const std::vector<Usable> usable = UsableIn(frame, snapshot);
  View view;
  view.frame = frame.id;
  view.capture_time_ns = frame.capture_time_ns;
  view.camera = frame.camera;
  view.world_from_camera = snapshot.world_from_camera;
  view.distance = MedianRange(usable);
  std::vector<Eigen::Vector2d> pixels;
  for (const Usable& each : usable) {
    const auto bearing = frame.camera->Unproject(each.pixel);
    if (!bearing) continue;
    view.features.push_back(each.id);
    pixels.push_back(each.pixel);
    view.corners.bearings.push_back(bearing->normalized());
    view.corners.ranges_m.push_back(each.range);
  }
  view.corners.described = DescribePixels(frame.grey, pixels);
  ViewCorners more = DescribeCorners(frame.grey, *frame.camera, pixels, options_.corners);
  for (std::size_t k = 0; k < more.described.size(); ++k) {
    view.corners.described.push_back(more.described[k]);
    view.corners.bearings.push_back(more.bearings[k]);
    view.corners.ranges_m.push_back(0.0);
  }
  Triangulate(view);
  views_.push_back(std::move(view));
  if (views_.size() <= options_.max_views) return;
  // The older of the two most alike goes.
  std::size_t drop = 0;
  double least = std::numeric_limits<double>::max();
  for (std::size_t a = 0; a < views_.size(); ++a) {
    for (std::size_t b = a + 1; b < views_.size(); ++b) {
      const double apart =
          Apart(views_[a].world_from_camera, views_[b].world_from_camera, views_[a].distance);
      if (apart < least) {
        least = apart;
        drop = a;
      }
    }
  }
  views_.erase(views_.begin() + static_cast<std::ptrdiff_t>(drop));
}

void KeyframeMaker::Triangulate(View& view) {
  std::vector<std::pair<double, View*>> partners;
  for (View& other : views_) {
    const double baseline =
        (other.world_from_camera.translation - view.world_from_camera.translation).norm();
    const double turned = RotationAngle(other.world_from_camera, view.world_from_camera);
    if (baseline < kBaseline * view.distance || turned > kMostTurned_rad) continue;
    partners.emplace_back(baseline / view.distance + turned, &other);
  }
  std::sort(partners.begin(), partners.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  if (partners.size() > kPartners) partners.resize(kPartners);
  for (const auto& [apart, partner] : partners) {
    TriangulateCorners(*view.camera, {view.world_from_camera, &view.corners},
                       {partner->world_from_camera, &partner->corners}, kNear * view.distance,
                       kFar * view.distance);
  }
}

void KeyframeMaker::PlaceAnew(View& view, const MapSnapshot& snapshot) const {
  std::unordered_map<FeatureId, Eigen::Vector3d> now;
  for (const FeatureSnapshot& feature : snapshot.features) {
    if (feature.depth_known) now[feature.id] = feature.point_in_world;
  }
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<std::size_t> which;
  for (std::size_t k = 0; k < view.features.size(); ++k) {
    const auto at = now.find(view.features[k]);
    if (at == now.end()) continue;
    points.push_back(at->second);
    pixels.push_back(view.corners.described[k].pixel);
    which.push_back(k);
  }
  if (points.size() < 8) return;
  const auto fit =
      FitPose(*view.camera, points, pixels, view.world_from_camera, {.max_iterations = 8});
  if (!fit.ok() || fit->rms_px > kMisfit_px) return;
  std::vector<double> ratios;
  for (std::size_t k = 0; k < which.size(); ++k) {
    double& range = view.corners.ranges_m[which[k]];
    const double renewed = (points[k] - fit->world_from_camera.translation).norm();
    if (range > 0.0) ratios.push_back(renewed / range);
    range = renewed;
  }
  view.world_from_camera = fit->world_from_camera;
  if (ratios.empty()) return;
  const auto middle = ratios.begin() + std::ssize(ratios) / 2;
  std::nth_element(ratios.begin(), middle, ratios.end());
  // The corners go with the features.
  for (std::size_t k = view.features.size(); k < view.corners.ranges_m.size(); ++k) {
    view.corners.ranges_m[k] *= *middle;
  }
  view.distance *= *middle;
}

void KeyframeMaker::Tell(View& view, const MapSnapshot& snapshot, std::vector<TeamKeyframe>& told) {
  TeamKeyframe keyframe;
  keyframe.frame = view.frame;
  keyframe.edition = ++view.edition;
  keyframe.capture_time_ns = view.capture_time_ns;
  keyframe.told_time_ns = snapshot.capture_time_ns;
  keyframe.generation = snapshot.map_generation;
  keyframe.metric = snapshot.metric;
  keyframe.camera = view.camera->intrinsics();
  keyframe.world_from_camera = view.world_from_camera;
  view.told_known = 0;
  for (std::size_t k = 0; k < view.corners.described.size(); ++k) {
    const DescribedPoint& described = view.corners.described[k];
    keyframe.points.push_back(
        {described.pixel, view.corners.ranges_m[k], described.descriptors, described.present});
    view.told_known += view.corners.ranges_m[k] > 0.0 ? 1 : 0;
  }
  view.told_pose = view.world_from_camera;
  view.told = keyframe;
  told.push_back(std::move(keyframe));
}

std::vector<TeamKeyframe> KeyframeMaker::Add(const Frame& frame, const MapSnapshot& snapshot) {
  std::vector<TeamKeyframe> told;
  if (generation_ != snapshot.map_generation) views_.clear();
  generation_ = snapshot.map_generation;
  if (snapshot.status != TrackingStatus::kTracking || !frame.camera) return told;
  const std::vector<Usable> usable = UsableIn(frame, snapshot);
  if (std::ssize(usable) < options_.fewest_points) return told;
  if (Wanted(snapshot, MedianRange(usable))) {
    AddView(frame, snapshot);
    Tell(views_.back(), snapshot, told);
  }
  const bool moved = revision_ != snapshot.map_revision;
  if (!moved && Seconds(snapshot.capture_time_ns - looked_ns_) < options_.look_again_s) return told;
  revision_ = snapshot.map_revision;
  looked_ns_ = snapshot.capture_time_ns;
  for (View& view : views_) {
    if (view.frame == frame.id) continue;
    PlaceAnew(view, snapshot);
    const auto known = std::count_if(view.corners.ranges_m.begin(), view.corners.ranges_m.end(),
                                     [](double range) { return range > 0.0; });
    if ((view.world_from_camera.translation - view.told_pose.translation).norm() >
            kMovedShare * view.distance ||
        RotationAngle(view.world_from_camera, view.told_pose) > kMoved_rad ||
        static_cast<double>(known) > kMoreOfKeyframe * view.told_known + 5) {
      Tell(view, snapshot, told);
    }
  }
  return told;
}

std::vector<TeamKeyframe> KeyframeMaker::All() const {
  std::vector<TeamKeyframe> all;
  for (const View& view : views_) {
    if (view.edition > 0) all.push_back(view.told);
  }
  return all;
}

}  // namespace saccade
