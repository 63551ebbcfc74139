#pragma once

#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/features/search.hpp"
#include "server/filter/filter_state.hpp"
#include "server/map/dormant_landmarks.hpp"
#include "server/tracker/frame_matcher.hpp"

namespace saccade {

/// Landmarks at rest that the ordinary search has not met for a while: the old side of a loop.
using OldLandmarks = std::vector<std::pair<const DormantLandmark*, KeyframeGraph::Recalled>>;

/// What one frame says of whether the old part of the map is in view.
struct LoopSight {
  Rigid3 old_from_camera;           // where the old part sees the camera
  Rigid3 present_from_camera;       // where the filter has it
  int expected = 0, found = 0;      // old landmarks that should be seen, and that were
  int agreed = 0;                   // of those, with one pose
  std::vector<double> scales;       // lengths in the old part / in the present one, one a point
  std::vector<KeyframeId> anchors;  // of those that agreed
  double distance_m = 1.0;          // to them, median
};

/// Looks for old landmarks where they should be seen from `expected_pose` (in the old part's
/// coordinates), patch by patch, and fits a pose to what is found. Nothing if what is seen does not
/// prove the place:
///  - at least 15 should be in view and half of them are: of another place that shares a poster
///    with this one the rest is missing;
///  - 12 agree with one pose to 2 px, three quarters of what was found, spread over the picture;
///  - they are not in one plane: a poster is, and says nothing of the room it hangs in.
std::optional<LoopSight> LookForOld(const OldLandmarks& old, const Rigid3& expected_pose,
                                    const ImagePyramid& pyramid, const CameraModel& camera,
                                    const FilterState& filter, const FrameMatches& matches);

/// `old_from_present` that sights of several frames agree on; nothing if they do not. Scale is
/// that of points seen in both parts, or of the way between the sights where that is long; its
/// sigma goes with it.
struct LoopAgreement {
  Similarity3 old_from_present;
  double log_scale_sigma = 0.05;
};
std::optional<LoopAgreement> Agree(std::span<const LoopSight> sights);

}  // namespace saccade
