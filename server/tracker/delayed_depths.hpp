#pragma once

#include <map>
#include <span>

#include "server/filter/depth_particles.hpp"
#include "server/filter/filter_state.hpp"
#include "server/map/map.hpp"
#include "server/tracker/births.hpp"
#include "server/tracker/frame_matcher.hpp"
#include "server/tracker/front_end.hpp"

namespace saccade {

/// The `classic` start (slam-spec 5.3; Davison, Mayol, Murray 2003): a new feature is a line of
/// sight in the filter, which gives no update, until particles along it agree on a range; what does
/// not come to an agreement is forgotten. For comparison: by default features are used from the
/// next frame on, with what is known of their range (docs/derivations/birth.md).
class DelayedDepths {
 public:
  void Reset() { searched_.clear(); }

  /// Landmarks from `first` on, born in this frame, are to wait. `unit`: of the particles' ranges
  /// and of the speed, 1 m; where the map has a scale of its own, the distance to what is in view.
  void Adopt(FeatureId first, double unit, Map& map);
  /// One attempt at each that waits and is in view, where the camera moves enough for it.
  void Step(const CameraModel& camera, const FrameMatches& matches, const FrameMatcher& matcher,
            FrontEnd& front_end, Map& map, FilterState& filter);

  std::size_t waiting() const { return searched_.size(); }

 private:
  struct Search {
    DepthParticles particles;
    double unit = 1.0;
  };
  DepthVerdict Attempt(const CameraModel& camera, const CameraMotion& motion,
                       const FrameMatcher& matcher, const Landmark& landmark,
                       const FilterState& filter, FrontEnd& front_end, Search& search) const;

  std::map<FeatureId, Search> searched_;
};

}  // namespace saccade
