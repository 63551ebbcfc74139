#pragma once

#include "server/filter/filter_state.hpp"
#include "server/tracker/frame_matcher.hpp"

namespace saccade {

struct SurpriseOptions {
  double noise_times = 3.0;  // of the motion noise, after an unexpected move
};

/// Whether a frame's search is worth repeating with more room: few of its first stage agree, and
/// the frame before was followed. Once: in a row of blind frames every widening would make the next
/// search more hopeless.
inline bool IsWorthWidening(const FrameMatches& matches, int accepted_before, int followed_from) {
  return matches.surprised && accepted_before >= followed_from;
}

/// Widens what is known of a camera that was at `before` and has moved `dt` seconds on, by motion
/// noise `noise` (its acceleration was another than any that noise allows for).
inline void WidenAfterSurprise(const CameraMotion& before, double dt, const MotionNoise& noise,
                               const SurpriseOptions& options, FilterState& filter) {
  const MotionNoise wild{options.noise_times * noise.acceleration_m_s2,
                         options.noise_times * noise.angular_acceleration_rad_s2};
  filter.Inflate(LineariseMotion(before, before.world_from_camera.rotation, dt, wild).q);
}

}  // namespace saccade
