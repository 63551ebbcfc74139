#include "server/map/dormant_landmarks.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {

void DormantLandmarks::Put(DormantLandmark landmark) {
  const FeatureId id = landmark.landmark.id;
  landmarks_.insert_or_assign(id, std::move(landmark));
  if (static_cast<int>(landmarks_.size()) <= options_.max_landmarks) return;
  landmarks_.erase(
      std::min_element(landmarks_.begin(), landmarks_.end(), [](const auto& a, const auto& b) {
        return a.second.landmark.matched < b.second.landmark.matched;
      }));
}

DormantLandmark DormantLandmarks::Take(FeatureId id) {
  return std::move(landmarks_.extract(id).mapped());
}

void DormantLandmarks::Move(const std::function<Similarity3(FeatureId)>& world_from_before) {
  for (auto& [id, dormant] : landmarks_) {
    const Similarity3 moved = world_from_before(id);
    const Eigen::Matrix3d turn = moved.scale * moved.rotation.toRotationMatrix();
    dormant.covariance_in_world = turn * dormant.covariance_in_world * turn.transpose();
    dormant.inverse_range_sigma /= moved.scale;
    // What was looked for in vain was looked for at a wrong place.
    dormant.failures = 0;
    dormant.rests_until = 0;
  }
}

void DormantLandmarks::Locate(const VersionOf& version, const Lookup& lookup) {
  KeyframeId asked = -1;  // those of one keyframe mostly follow each other
  std::uint64_t now = 0;
  const auto version_of = [&](KeyframeId id) {
    if (id != asked) now = version(id);
    asked = id;
    return now;
  };
  for (auto at = landmarks_.begin(); at != landmarks_.end();) {
    DormantLandmark::Place& place = at->second.place;
    if (place.version != 0 && version_of(place.known.anchor) == place.version) {
      ++at;
      continue;
    }
    const auto known = lookup(at->first);
    if (!known) {
      at = landmarks_.erase(at);
      continue;
    }
    ++at;
    place.version = version_of(known->anchor);
    place.known = *known;
    place.somewhere = known->estimate.inverse_range > 0.0;
    if (!place.somewhere) continue;
    place.range_m = 1.0 / known->estimate.inverse_range;
    place.ray = known->world_from_anchor.rotation * known->estimate.bearing;
    place.point_in_world = known->PointInWorld();
  }
}

std::vector<std::pair<KeyframeId, std::vector<FeatureId>>> DormantLandmarks::InView(
    const CameraModel& camera, const Rigid3& world_from_camera, std::int64_t frame, int wanted,
    std::span<const Eigen::Vector2d> occupied) const {
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  const double least_cosine = std::cos(options_.max_view_angle_rad);
  std::map<KeyframeId, std::vector<FeatureId>> by_keyframe;
  for (const auto& [id, dormant] : landmarks_) {
    if (frame < dormant.rests_until) continue;
    const DormantLandmark::Place& place = dormant.place;
    if (!place.somewhere) continue;
    const double range = place.range_m;
    const Eigen::Vector3d& point = place.point_in_world;
    const Eigen::Vector3d seen = camera_from_world * point;
    const double distance = seen.norm();
    if (seen.z() < 0.2 * distance || distance * options_.max_scale < range ||
        distance > options_.max_scale * range) {
      continue;
    }
    const double cosine = place.ray.dot(point - world_from_camera.translation) / distance;
    if (cosine < least_cosine) continue;
    const auto pixel = camera.Project(seen);
    if (!pixel || !camera.InImage(*pixel, options_.border_px)) continue;
    const auto near = [&](const Eigen::Vector2d& other) {
      return (other - *pixel).squaredNorm() < options_.apart_px * options_.apart_px;
    };
    if (std::any_of(occupied.begin(), occupied.end(), near)) continue;
    by_keyframe[place.known.anchor].push_back(id);
  }
  std::erase_if(by_keyframe, [&](const auto& group) {
    const auto seeded = [&](FeatureId id) { return landmarks_.at(id).landmark.seeded; };
    return static_cast<int>(group.second.size()) < options_.fewest_together &&
           std::none_of(group.second.begin(), group.second.end(), seeded);
  });
  std::vector<std::pair<KeyframeId, std::vector<FeatureId>>> ranked(by_keyframe.begin(),
                                                                    by_keyframe.end());
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.second.size() > b.second.size(); });
  int count = 0;
  const auto enough = [&](const auto& group) {
    if (count >= wanted) return true;
    count += static_cast<int>(group.second.size());
    return false;
  };
  ranked.erase(std::find_if(ranked.begin(), ranked.end(), enough), ranked.end());
  return ranked;
}

}  // namespace saccade
