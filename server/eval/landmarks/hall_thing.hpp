#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace saccade {

/// What happens in the hall.
enum class HallMotion {
  kSquares,  // before eight squares on two walls; half of them covered, then all
  kFlip,     // one small square, seen 5 to 20 degrees from frontal
  kPillar,   // as kSquares; a pillar stands before some of them, nothing else covers them
  kPasser,   // as kSquares; somebody walks past them, again and again
  kAway,     // from the squares into the part of the hall that has none, and back
};

/// What stands in the hall, or walks there, at that time: a box along the axes, in world; empty
/// where there is nothing.
Eigen::AlignedBox3d ThingInHall(HallMotion motion, double time_s);

/// Where a ray from outside enters a box, in lengths of `direction`; nothing if it does not.
std::optional<double> EntersBox(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& origin,
                                const Eigen::Vector3d& direction);

/// Grey level of a thing where it is looked at: checks, edges everywhere, which nobody may take for
/// a square's.
double LookOfThing(const Eigen::Vector3d& point_in_world);

}  // namespace saccade
