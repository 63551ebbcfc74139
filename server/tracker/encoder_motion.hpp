#pragma once

#include "server/filter/motion_model.hpp"
#include "server/mount/mount_model.hpp"

namespace saccade {

/// What the joints did to the camera from one frame to the next, `dt` seconds later, by its
/// encoders' readings (docs/derivations/prediction.md).
///
/// The covariance is that of two independent readings, each wrong by the encoders' sigma and by
/// what the joint moves within the time stamps' error. `metric` false: the map's unit is unknown,
/// so the optic centre's path (metres) is not used but added to what is uncertain.
HeadMotion EncoderMotion(const MountModel& model, const MountAngles& before,
                         const MountAngles& after, double dt, bool metric);

/// How fast the camera may turn in an exposure [rad/s], from its mean rates over the time since the
/// frame before and over the time before that: a saccade that begins is faster by now than on the
/// average.
double RateWhenExposed(double mean_rad_s, double mean_before_rad_s);

}  // namespace saccade
