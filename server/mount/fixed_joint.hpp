#pragma once

#include "server/mount/mount_options.hpp"

namespace saccade {

/// A joint without a motor: it stays at zero, and whoever plans knows it by its limits.
inline void FixJoint(JointOptions& joint) {
  constexpr double kFixed_rad = 1e-6;  // Validate() wants room between the limits
  joint.min_rad = -kFixed_rad;
  joint.max_rad = kFixed_rad;
}
inline bool IsFixed(const JointOptions& joint) { return joint.max_rad - joint.min_rad < 1e-5; }

}  // namespace saccade
