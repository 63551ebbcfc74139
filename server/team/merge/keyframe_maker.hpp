#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/capture/frame.hpp"
#include "server/map/view_corners.hpp"
#include "shared/scene/map_snapshot.hpp"
#include "shared/scene/team_keyframe.hpp"

namespace saccade {

struct KeyframeMakerOptions {
  double apart_share = 0.08;    // of the distance to what is in view, from every other keyframe
  double apart_rad = 0.14;      // 8 deg
  double at_least_every_s = 2;  // also where nothing is new: the map may have drifted
  int fewest_points = 12;       // measured in the picture and of known depth
  int corners = 350;            // beside them
  std::size_t max_views = 150;  // then the one nearest to another goes
  double look_again_s = 1.0;    // how often older ones are held against the map as it is now
};

/// Makes of pictures and what a tracker said of them the keyframes that others recognise places by.
///
/// Corners beside the map's features get their range from pictures taken elsewhere. Where the map
/// has moved meanwhile (adjustment, loop), older keyframes are placed anew by the features that
/// they saw, and told again. Reads what is published and nothing else. One thread.
class KeyframeMaker {
 public:
  explicit KeyframeMaker(const KeyframeMakerOptions& options = {}) : options_(options) {}

  /// What is to be told after this frame: new keyframes, and older ones of which more is known.
  std::vector<TeamKeyframe> Add(const Frame& frame, const MapSnapshot& snapshot);
  /// All there is, as it was told last: for who comes late.
  std::vector<TeamKeyframe> All() const;
  std::size_t size() const { return views_.size(); }

 private:
  struct View {
    FrameId frame = 0;
    Timestamp capture_time_ns = 0;
    std::shared_ptr<const CameraModel> camera;
    Rigid3 world_from_camera;
    std::vector<FeatureId> features;  // what the first corners show
    ViewCorners corners;
    double distance = 1.0;
    std::uint32_t edition = 0;
    Rigid3 told_pose;
    int told_known = 0;
    TeamKeyframe told;
  };

  bool Wanted(const MapSnapshot& snapshot, double distance) const;
  void AddView(const Frame& frame, const MapSnapshot& snapshot);
  void Triangulate(View& view);
  /// Pose and ranges by where its features are now.
  void PlaceAnew(View& view, const MapSnapshot& snapshot) const;
  void Tell(View& view, const MapSnapshot& snapshot, std::vector<TeamKeyframe>& told);

  KeyframeMakerOptions options_;
  std::vector<View> views_;
  std::uint64_t generation_ = 0, revision_ = 0;
  Timestamp looked_ns_ = 0;
};

}  // namespace saccade
