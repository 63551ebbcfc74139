#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/anchors/anchor_options.hpp"
#include "server/anchors/depth_doubt.hpp"
#include "server/anchors/scale_chain.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/map_snapshot.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

/// A snapshot whose features are found by id in constant time; made once per frame.
class MapView {
 public:
  /// `scale`: how surely its parts have one scale; null: surely. `trail`: of the frames before;
  /// null: not known. Both outlive the view. `surface`: as published last.
  explicit MapView(std::shared_ptr<const MapSnapshot> snapshot, const ScaleChain* scale = nullptr,
                   const PoseTrail* trail = nullptr,
                   std::shared_ptr<const SurfaceSnapshot> surface = nullptr);
  const MapSnapshot& snapshot() const { return *snapshot_; }
  /// Null if the map does not hold it (any more).
  const FeatureSnapshot* Find(FeatureId id) const;
  const PoseTrail* trail() const { return trail_; }
  /// Of the place as this map has it; null: none is known.
  const SurfaceSnapshot* surface() const {
    const bool same = surface_ && surface_->generation == snapshot_->map_generation;
    return same ? surface_.get() : nullptr;
  }
  /// Variance of the logarithm of the scale around a feature.
  double ScaleVariance(FeatureId id) const { return scale_ ? scale_->Of(id) : 0.0; }

 private:
  std::shared_ptr<const MapSnapshot> snapshot_;
  const ScaleChain* scale_;
  const PoseTrail* trail_;
  std::shared_ptr<const SurfaceSnapshot> surface_;
  /// Begins of the stretches of rising ids: the tracker's lists are two. No index of all features
  /// for every frame: most of a large map rests, and few are asked for.
  std::vector<std::size_t> stretches_;
};

/// One of the features that carry an anchor.
struct ClusterMember {
  FeatureId id = 0;
  double weight = 1.0;                                      // 1 / (sigma^2 (dist^2 + softening^2))
  Eigen::Vector3d at_binding = Eigen::Vector3d::Zero();     // in binding [m]
  Eigen::Vector3d last_in_world = Eigen::Vector3d::Zero();  // in the frame before [m]
};

/// How an anchor hangs in the map. `binding` is the world frame as the map had it when the anchor
/// was placed; `world_from_binding`, a weighted rigid fit of the members, carries it to now.
struct AnchorPlace {
  std::uint64_t id = 0;  // new with each placing; equal: the same place, edited otherwise
  std::uint64_t map_generation = 0;
  bool attached = false;  // false: known only by its point, if at all (restart, reset)
  std::string world_key;  // of the world the point was placed in
  AnchorMethod method = AnchorMethod::kPoint;
  std::vector<ClusterMember> members;

  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // drawn, in binding [m]
  /// What the click alone said, in binding, and how sure, relative to the members [m^2].
  Eigen::Vector3d clicked_point = Eigen::Vector3d::Zero();
  Eigen::Matrix3d clicked_covariance = Eigen::Matrix3d::Zero();
  double distance_m = 1.0;        // from the camera when it was placed: scale of what is near
  std::optional<FeatureId> seed;  // feature at the very pixel; refines the point as it converges
  bool seed_seen = false;         // a new one is in the map from the next frame on
  bool seed_is_target = false;    // the feature itself was chosen
  DepthDoubt doubt;               // of what was clicked, along `doubt_ray`
  Eigen::Vector3d doubt_ray = Eigen::Vector3d::Zero();     // in binding, unit; zero: there is none
  Eigen::Vector3d clicked_from = Eigen::Vector3d::Zero();  // the camera then, in binding [m]
  std::optional<ClickLook> look;  // until it is known whether the click is on an outline

  Rigid3 world_from_binding;
  /// The seeded feature's own covariance while it was the better witness, in binding [m^2].
  std::optional<Eigen::Matrix3d> seed_covariance;
  Timestamp placed_ns = 0;
  Timestamp last_selected_ns = 0;  // members were last compared with the rest of the map
  bool was_tracking = false;       // has been sure once: now never PROVISIONAL again
  bool was_sure = false;           // the same, by its members and its click alone
  double seen_s = 0;               // since then a member was measured for so long
  bool paused = false;             // by its own error (hysteresis)
  Timestamp above_ns = 0;          // while paused: when that was last above its limit
  Timestamp last_time_ns = 0;
};

/// Estimate of one anchor in one frame.
struct PlaceEstimate {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();        // [m]
  Eigen::Matrix3d covariance_in_world = Eigen::Matrix3d::Zero();   // [m^2]
  Eigen::Matrix3d covariance_in_camera = Eigen::Matrix3d::Zero();  // camera pose included [m^2]
  double scale_sigma_m = 0;    // of it, by the scale of that part of the map
  double outline_sigma_m = 0;  // of it, because it is on an outline
};

/// Carries `place` to this frame: fits the members' motion, replaces those that the map dropped
/// without moving the point, and takes over the seeded feature's better depth gradually. A place
/// without members (a new one) hangs itself on the nearest features with known depth; where there
/// are none it stays where it is in world. `selections_left`: how often the whole map may still be
/// searched in this frame for better company than a place has; counted down.
PlaceEstimate Follow(const MapView& map, const AnchorOptions& options, AnchorPlace& place,
                     int& selections_left);

}  // namespace saccade
