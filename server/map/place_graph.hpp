#pragma once

#include <atomic>
#include <map>
#include <optional>
#include <vector>

#include "server/map/keyframe_graph.hpp"
#include "shared/geometry/similarity3.hpp"

namespace saccade {

/// A place recognised: the map's old part and its new part show the same thing, and this is how one
/// lies in the other.
struct Loop {
  KeyframeId old_keyframe = 0, new_keyframe = 0;
  Similarity3 old_from_new;       // of world coordinates
  double distance_m = 1.0;        // to what was recognised
  double log_scale_sigma = 0.05;  // of old_from_new's scale
  KeyframeId rigid_from = 0;      // from this one on the new part moves as one: the filter has it
};

/// How the map moves: `world_from_before` of what each keyframe saw first.
struct MapCorrection {
  std::map<KeyframeId, Similarity3> of;  // not empty
  /// Of keyframes that came later, the newest's.
  const Similarity3& Of(KeyframeId id) const {
    const auto at = of.find(id);
    return at == of.end() ? of.rbegin()->second : at->second;
  }
  const Similarity3& newest() const { return of.rbegin()->second; }
};

/// Spreads the error of a loop over the keyframes (pose graph of similarities): their relative
/// poses are what was measured, less surely the longer the step; the first keyframe, and those that
/// saw a target, stay. Nothing: stopped, or the graph had to be bent more than drift can explain.
std::optional<MapCorrection> CloseLoop(const KeyframeGraph::Outline& outline, const Loop& loop,
                                       const std::atomic<bool>* stop = nullptr);

}  // namespace saccade
