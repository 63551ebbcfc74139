#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "server/anchors/anchor_place.hpp"
#include "server/anchors/frame_ring.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// What a target means in the newest map.
struct ResolvedTarget {
  AnchorMethod method = AnchorMethod::kPoint;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();       // [m]
  Eigen::Matrix3d covariance_in_world = Eigen::Matrix3d::Zero();  // relative to the map near it
  double distance_m = 1.0;                                        // from the camera that saw it
  std::optional<FeatureId> feature;  // the target is this feature, or it lies at the very pixel
  bool feature_is_target = false;
  Eigen::Vector3d normal_in_world = Eigen::Vector3d::Zero();  // of the surface, unit; zero: unknown

  /// For pixels: the frame, its pose in the newest map and the depth along the ray, for seeding a
  /// feature there and for ink.
  struct View {
    PastFrame past;
    Rigid3 world_from_camera;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    double depth_m = 0;  // along the ray, from the camera's centre
    double depth_sigma_m = 0;
  };
  std::optional<View> view;
  DepthDoubt doubt;  // of a pixel: the surface may be another
};

/// Carries a transform from the map as `before` had it to the newest map: world frames differ by
/// the corrections in between. Weighted by nearness to `ray_in_world` from the camera of `before`.
Rigid3 NewestFromPast(const MapSnapshot& before, const MapView& newest,
                      const Eigen::Vector3d& ray_in_world);

/// How much is asked to find the surface: features and pictures, or features alone (a pointer,
/// which is gone in a second; `frames` then need no pictures).
enum class ClickCare { kFull, kLight };

/// Resolves a target (slam-spec section 9). Errors as AnchorManager::Create.
absl::StatusOr<ResolvedTarget> ResolveTarget(const AnnotationTarget& target,
                                             const FrameLookup& frames, const MapView& newest,
                                             const AnchorOptions& options,
                                             ClickCare care = ClickCare::kFull);

/// The line of sight of a pixel, by its frame's pose, in the newest map. Errors as ResolveTarget.
struct PixelRay {
  PastFrame past;
  Rigid3 newest_from_past;
  Rigid3 world_from_camera;
  Eigen::Vector3d ray_in_world = Eigen::Vector3d::UnitZ();  // unit
};
absl::StatusOr<PixelRay> CastPixel(const PixelTarget& target, const FrameLookup& frames,
                                   const MapView& newest);

/// The stroke as offsets from the anchor, on the surface that the click found [m]. Pixels whose ray
/// misses that surface are put at the anchor's own distance.
std::vector<Eigen::Vector3d> ProjectInk(const std::vector<Eigen::Vector2d>& ink_px,
                                        const ResolvedTarget& target);

}  // namespace saccade
