// The part of KeyframeGraph that shows its shape and moves it (loops).
#include <algorithm>

#include "server/map/keyframe_graph.hpp"

namespace saccade {

KeyframeGraph::Outline KeyframeGraph::MakeOutline() const {
  constexpr int kFewest = 5;  // points: fewer tie nothing
  Outline outline;
  std::map<KeyframeId, int> index;
  for (const auto& [id, keyframe] : keyframes_) {
    index[id] = static_cast<int>(outline.keyframes.size());
    const bool sees_target =
        std::any_of(keyframe.sightings.begin(), keyframe.sightings.end(),
                    [](const GraphSighting& sighting) { return sighting.known_point.has_value(); });
    outline.keyframes.push_back({id, keyframe.world_from_camera, keyframe.distance_m, sees_target});
  }
  std::map<std::pair<int, int>, int> shared;
  for (const auto& [id, point] : points_) {
    for (const KeyframeId from : point.seen_from) ++shared[{index[point.anchor], index[from]}];
  }
  for (const auto& [pair, count] : shared) {
    if (count >= kFewest) outline.ties.push_back({pair.first, pair.second, count});
  }
  return outline;
}

void KeyframeGraph::Move(const std::function<const Similarity3&(KeyframeId)>& world_from_before) {
  for (auto& [id, keyframe] : keyframes_) {
    const Similarity3& moved = world_from_before(id);
    keyframe.world_from_camera = moved.Move(keyframe.world_from_camera);
    keyframe.distance_m *= moved.scale;
    keyframe.version = ++changes_;
    for (const FeatureId born : keyframe.births) {
      const auto at = points_.find(born);
      if (at == points_.end()) continue;
      at->second.estimate.inverse_range /= moved.scale;
      at->second.birth.inverse_range /= moved.scale;
      at->second.birth.inverse_range_sigma /= moved.scale;
    }
  }
}

}  // namespace saccade
