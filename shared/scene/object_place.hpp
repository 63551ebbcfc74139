#pragma once

#include <optional>
#include <span>

#include "shared/scene/annotation.hpp"
#include "shared/scene/marker_pose.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade {

/// Where an object is. `annotations` and `markers`: ranges of Annotation and MarkerPose. Nothing
/// where it is fixed to something whose place is not known.
template <typename Annotations>
std::optional<Rigid3> WorldFromObject(const SceneObject& object, const Annotations& annotations,
                                      std::span<const MarkerPose> markers) {
  switch (object.parent) {
    case SceneParent::kWorld:
      return object.parent_from_object;
    case SceneParent::kMarker:
      for (const MarkerPose& one : markers) {
        if (one.id != object.marker_id || one.family != object.marker_family) continue;
        return one.world_from_marker * object.parent_from_object;
      }
      return std::nullopt;
    case SceneParent::kAnchor:
      break;
  }
  for (const Annotation& one : annotations) {
    if (one.id != object.annotation_id || !one.anchor.place_known) continue;
    return Rigid3{Eigen::Quaterniond::Identity(), one.anchor.point_in_world} *
           object.parent_from_object;
  }
  return std::nullopt;
}

}  // namespace saccade
