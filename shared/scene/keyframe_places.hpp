#pragma once

#include <cstdint>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// A frame that the map keeps, and where it was taken from as far as is known now.
struct KeyframePlace {
  std::int64_t id = 0;  // of the keyframe: rises, never used twice within one generation
  FrameId frame = 0;
  Rigid3 world_from_camera;  // [m] if the map is metric
  double distance_m = 1.0;   // typical, to what was in view; changes with the map's scale
};

/// The map's keyframes whose frames this run has seen, by rising id. Immutable once published.
struct KeyframePlaces {
  std::uint64_t generation = 0;  // MapSnapshot::map_generation; another one: forget all before
  bool metric = false;           // world is in metres
  std::vector<KeyframePlace> keyframes;
};

}  // namespace saccade
