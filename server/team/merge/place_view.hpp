#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/map/picture_description.hpp"
#include "shared/scene/team_keyframe.hpp"

namespace saccade {

/// A keyframe of a map, ready to be compared. Immutable; shared.
struct PlaceView {
  TeamKeyframe told;
  std::shared_ptr<const CameraModel> camera;
  std::vector<DescribedPoint> described;         // of told.points
  std::vector<Eigen::Vector3d> points_in_world;  // of those with a range; else of range 1
  double distance = 1.0;                         // median range
  int known = 0;                                 // points with a range

  /// InvalidArgument never: what cannot be used (a pixel that the lens does not have) has no range.
  static std::shared_ptr<const PlaceView> Make(TeamKeyframe keyframe);
  const Rigid3& world_from_camera() const { return told.world_from_camera; }
  bool Knows(std::size_t point) const { return told.points[point].range > 0.0; }
};

/// Keyframes of one map, the newest edition of each. Values; one thread.
class PlaceBook {
 public:
  explicit PlaceBook(std::size_t max_views = 150) : max_views_(max_views) {}

  /// Null if an older edition, or one of a map that was thrown away: nothing changes. A new
  /// generation throws all before it away.
  std::shared_ptr<const PlaceView> Take(TeamKeyframe keyframe);

  using Views = std::map<FrameId, std::shared_ptr<const PlaceView>>;
  const Views& views() const { return views_; }
  std::optional<std::uint64_t> generation() const { return generation_; }
  bool metric() const { return metric_; }
  std::shared_ptr<const PlaceView> Find(FrameId frame) const;

  /// Views most like `query` by what their points look like, best first, at most `most`.
  std::vector<std::shared_ptr<const PlaceView>> MostAlike(const PlaceView& query,
                                                          std::size_t most) const;
  /// Views that look at about the same from about there, nearest first, at most `most`.
  /// `distance`: to what is seen from there.
  std::vector<std::shared_ptr<const PlaceView>> Near(const Rigid3& world_from_camera,
                                                     double distance, std::size_t most) const;

 private:
  void DropMostRedundant();

  std::size_t max_views_;
  Views views_;
  std::optional<std::uint64_t> generation_;
  bool metric_ = false;
};

}  // namespace saccade
