// The part of the map that outlives its filter.
#include <algorithm>

#include "server/map/map.hpp"
#include "server/map/stored_map.hpp"

namespace saccade {

void Map::StoreInto(StoredMap& stored, const FilterState& filter) const {
  stored.keyframes = keyframes_.Save();
  auto points = &stored.keyframes.points;
  for (const auto& [keyframe, clone] : clones_) {
    const auto at = stored.keyframes.keyframes.find(keyframe);
    const std::optional<Rigid3> now = filter.ClonePose(clone);
    if (at != stored.keyframes.keyframes.end() && now) at->second.world_from_camera = *now;
  }
  const auto put = [&](DormantLandmark dormant) {
    if (!points->contains(dormant.landmark.id)) return;  // no keyframe could tell where it is
    dormant.home = 0;
    dormant.rests_until = 0;
    dormant.place = {};
    stored.at_rest.push_back(std::move(dormant));
  };
  for (const Landmark& landmark : in_use_.all()) {
    if (landmark.known) {
      stored.known.push_back(landmark);
      continue;
    }
    if (!filter.Has(landmark.id)) continue;
    const FeatureMarginal marginal = filter.Marginal(landmark.id);
    DormantLandmark dormant;
    dormant.landmark = landmark;
    dormant.inverse_range_sigma = marginal.inverse_range_sigma;
    dormant.covariance_in_world = marginal.covariance_in_world;
    const auto at = points->find(landmark.id);
    if (at != points->end()) {
      const PointFromClone point = filter.Point(landmark.id);
      at->second.estimate = {point.bearing, point.inverse_range};
    }
    put(std::move(dormant));
  }
  for (const auto& [id, dormant] : at_rest_.all()) put(dormant);
  std::sort(stored.at_rest.begin(), stored.at_rest.end(),
            [](const auto& a, const auto& b) { return a.landmark.id < b.landmark.id; });
}

bool Map::Load(const StoredMap& stored) {
  Clear();
  if (!keyframes_.Load(stored.keyframes)) return false;
  FeatureId newest = 0;
  for (const Landmark& landmark : stored.known) {
    in_use_.Add(landmark);
    newest = std::max(newest, landmark.id);
  }
  for (const DormantLandmark& dormant : stored.at_rest) at_rest_.Put(dormant);
  for (const auto& [id, point] : stored.keyframes.points) newest = std::max(newest, id);
  in_use_.SkipIds(newest);
  newest_feature_ = newest;
  return true;
}

}  // namespace saccade
