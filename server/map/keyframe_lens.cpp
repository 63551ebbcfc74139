// The part of the keyframe graph that learns a lens: all of it at once, and all of it anew.
#include <algorithm>
#include <cmath>
#include <set>

#include "server/map/keyframe_graph.hpp"

namespace saccade {
namespace {

constexpr int kMostKeyframes = 100;  // adjusted together with the lens...
constexpr int kAnchors = 60;         // ...of which the first views of the points seen most
constexpr int kMostPoints = 700;
constexpr std::size_t kFewestSights = 2;  // of a point besides its first: less says nothing

template <typename Rising>
int PositionOf(const Rising& rising, KeyframeId id) {
  const auto at = std::lower_bound(rising.begin(), rising.end(), id);
  return at != rising.end() && *at == id ? static_cast<int>(at - rising.begin()) : -1;
}

}  // namespace

KeyframeGraph::LensJob KeyframeGraph::MakeLensJob(const CameraModel& lens,
                                                  const Lookup& estimate) const {
  LensJob job;
  std::vector<std::pair<std::size_t, FeatureId>> ranked;
  for (const auto& [id, point] : points_) {
    if (point.seen_from.size() >= kFewestSights) ranked.emplace_back(point.seen_from.size(), id);
  }
  std::sort(ranked.rbegin(), ranked.rend());
  // First views of the points seen most, then keyframes evenly.
  std::set<KeyframeId> chosen;
  if (!keyframes_.empty()) chosen = {keyframes_.begin()->first, keyframes_.rbegin()->first};
  for (const auto& [count, id] : ranked) {
    if (static_cast<int>(chosen.size()) >= kAnchors) break;
    chosen.insert(points_.at(id).anchor);
  }
  std::vector<KeyframeId> others;
  for (const auto& [id, keyframe] : keyframes_) {
    if (!chosen.contains(id)) others.push_back(id);
  }
  const auto room =
      static_cast<std::size_t>(std::max(0, kMostKeyframes - static_cast<int>(chosen.size())));
  for (std::size_t k = 0; k < std::min(room, others.size()); ++k) {
    chosen.insert(others[k * others.size() / std::min(room, others.size())]);
  }
  job.keyframes.assign(chosen.begin(), chosen.end());
  std::unordered_map<FeatureId, int> index;
  for (const auto& [count, id] : ranked) {
    if (static_cast<int>(job.points.size()) >= kMostPoints) break;
    const Point& point = points_.at(id);
    const GraphEstimate now = estimate(id).value_or(point.estimate);
    const auto seen = lens.Project(point.birth.bearing);
    const int anchor = PositionOf(job.keyframes, point.anchor);
    if (anchor < 0 || !seen || !(now.inverse_range > 0.0)) continue;
    index[id] = static_cast<int>(job.points.size());
    job.points.push_back(id);
    job.problem.points.push_back({anchor, now.bearing, now.inverse_range, *seen,
                                  point.birth.sigma_rad / lens.RadiansPerPixel()});
  }
  for (std::size_t k = 0; k < job.keyframes.size(); ++k) {
    const Keyframe& keyframe = keyframes_.at(job.keyframes[k]);
    job.problem.world_from_camera.push_back(keyframe.world_from_camera);
    for (const GraphSighting& sighting : keyframe.sightings) {
      const auto pixel = lens.Project(sighting.ray);
      if (!pixel) continue;
      const double sigma_px = sighting.sigma_rad / lens.RadiansPerPixel();
      if (sighting.known_point) {
        job.problem.known.push_back({static_cast<int>(k), *sighting.known_point, *pixel, sigma_px});
      }
      const auto point = index.find(sighting.id);
      if (point == index.end()) continue;
      job.problem.sightings.push_back({static_cast<int>(k), point->second, *pixel, sigma_px});
    }
  }
  return job;
}

void KeyframeGraph::TakeLens(const LensJob& job, const LensChange& change) {
  std::unordered_map<FeatureId, const LensBundle::Point*> adjusted;
  for (std::size_t k = 0; k < job.points.size(); ++k) {
    adjusted[job.points[k]] = &job.problem.points[k];
  }
  // What the job left out goes along with the adjusted keyframe before it.
  std::map<KeyframeId, Rigid3> moved;
  for (std::size_t k = 0; k < job.keyframes.size(); ++k) {
    const auto before = Pose(job.keyframes[k]);
    if (before) {
      moved[job.keyframes[k]] = job.problem.world_from_camera[k] * before->Inverse();
    }
  }
  if (moved.empty()) return;
  for (auto& [id, keyframe] : keyframes_) {
    auto by = moved.upper_bound(id);
    if (by != moved.begin()) --by;
    keyframe.world_from_camera = by->second * keyframe.world_from_camera;
    keyframe.world_from_camera.rotation.normalize();
    keyframe.version = ++changes_;
    for (GraphSighting& sighting : keyframe.sightings) {
      sighting.ray = change.reray(sighting.ray);
      sighting.sigma_rad *= change.sigma_factor;
    }
  }
  for (auto& [id, point] : points_) {
    point.birth.bearing = change.reray(point.birth.bearing);
    point.birth.sigma_rad *= change.sigma_factor;
    const auto known = adjusted.find(id);
    if (known != adjusted.end()) {
      point.estimate = {known->second->bearing, known->second->inverse_range};
    } else {
      point.estimate.bearing = change.reray(point.estimate.bearing);
    }
  }
}

}  // namespace saccade
