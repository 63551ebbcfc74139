#pragma once

#include <Eigen/Dense>

#include "server/sim/sim_source.hpp"

namespace saccade {

/// True if a click on `point` from `eye` (both in world) hits another surface a few pixels beside
/// it: on an outline nobody can tell whether what is in front or what is behind is meant.
bool IsOnOutline(const SimSource& source, const Eigen::Vector3d& eye, const Eigen::Vector3d& point);

/// Whether the room has a surface within 30 % of the range of `point`, in its direction or a pixel
/// beside it: a corner of an outline is where one surface ends before another.
bool IsOnASurface(const SimSource& source, const Eigen::Vector3d& eye,
                  const Eigen::Vector3d& point);

}  // namespace saccade
