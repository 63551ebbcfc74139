#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/surface/surface_options.hpp"
#include "server/surface/surface_picture.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/keyframe_places.hpp"

namespace saccade {

/// A keyframe that may be compared with another.
struct ViewCandidate {
  std::int64_t id = 0;
  Rigid3 world_from_camera;
  Pinhole camera;
};

/// Those that see what the reference sees from beside, the best first, at most `options.views`:
/// parallax near the best, and not all from one side. `distance`: typical, to what it sees, in the
/// map's unit.
std::vector<std::int64_t> ChooseViews(const Rigid3& world_from_reference, double distance,
                                      std::span<const ViewCandidate> candidates,
                                      const SurfaceOptions& options);

/// Below 1: two keyframes are so near that one of them is enough.
double ApartBy(const KeyframePlace& a, const KeyframePlace& b, const SurfaceOptions& options);

/// Whether two cameras show the same things, seen from anywhere.
bool Overlap(const Rigid3& world_from_a, const Rigid3& world_from_b, const Pinhole& b,
             double distance);

}  // namespace saccade
