#pragma once

#include <Eigen/Dense>
#include <optional>

#include "client/tools/view.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade::tools {

/// Arrows and boxes are turned.
bool IsTurnable(const Annotation& mark);

/// From the anchor to the handle that turns a mark [m]: an arrow's is at its tail, a box's above
/// it.
double HandleLength(const Annotation& mark);
/// Where that handle is in the world [m].
Eigen::Vector3d HandlePoint(const Annotation& mark);

/// Turned so that the handle, `length_m` from the anchor, lies under `pixel`: on the near half of
/// its sphere if it was there before, else on the far one; beyond its rim, towards the pixel.
/// Nothing outside the lens.
std::optional<Eigen::Quaterniond> TurnedTo(const View& view, const Eigen::Vector2d& pixel,
                                           const Eigen::Vector3d& anchor_in_world, double length_m,
                                           const Eigen::Quaterniond& world_from_mark);

/// Turned by an angle in the plane of the picture, or tipped towards the eye.
Eigen::Quaterniond TurnedBy(const View& view, const Eigen::Quaterniond& world_from_mark,
                            double angle_rad, bool tips);

}  // namespace saccade::tools
