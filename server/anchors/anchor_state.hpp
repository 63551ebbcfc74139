#pragma once

#include "server/anchors/anchor_place.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// Anchor of an attached place as readers see it: point, covariance, expected error in metres and
/// pixels, state with the reason in words. `error_m` is relative to the camera of this frame: what
/// wearer and expert can see.
Anchor DescribeAnchor(const MapView& map, const CameraModel& camera, const AnchorOptions& options,
                      const PlaceEstimate& estimate, AnchorPlace& place);

/// The same annotation when its place is not known in this map: PAUSED at its last point.
Anchor DescribeDetached(const MapSnapshot& snapshot, const AnchorOptions& options,
                        const AnchorPlace& place, Anchor last);

}  // namespace saccade
