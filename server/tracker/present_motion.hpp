#pragma once

#include "server/filter/filter_state.hpp"

namespace saccade {

/// The newest step that a filter predicted.
struct MotionStep {
  double dt = 0.0;  // [s]; 0: none yet
  MotionNoise noise;
};

/// The camera's velocities when its newest picture was exposed. `filter` has predicted `step` and
/// has not been corrected since; `pose` is where the camera turned out to be.
///
/// M1 knows the mean of the velocities over a step: what the filter holds is half a step old when
/// it has been corrected, one and a half when it has predicted. Rows of a rolling shutter and
/// births want those of now: at 15 pictures a second a hand's are wrong by 0.2 m/s otherwise, which
/// is a pixel in the outer rows.
CameraMotion PresentMotion(const FilterState& filter, const Rigid3& pose, const MotionStep& step);

}  // namespace saccade
