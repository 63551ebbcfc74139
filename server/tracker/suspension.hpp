#pragma once

#include <optional>

#include "server/filter/motion_model.hpp"
#include "server/tracker/encoder_motion.hpp"

namespace saccade {

/// Whether a frame is worth searching while the head turns: above some rate (a saccade) every patch
/// is smeared, and what matches matches by chance. The wearer's predicted pose and the joints carry
/// the camera then.
class Suspension {
 public:
  /// `most_rad_s`: the head's own rate during exposure that pictures are still searched at.
  explicit Suspension(double most_rad_s) : most_rad_s_(most_rad_s) {}

  /// Encoders and rates of the frame before say nothing of the next one.
  void Forget() { mean_rate_rad_s_ = 0.0; }
  /// Once a frame: what the joints did in the `dt` seconds before it; null: no encoders, and no
  /// suspension. True: the frame is not searched.
  bool Suspends(const HeadMotion* head, double dt) {
    const double rate =
        head != nullptr ? LogQuaternion(head->camera_from_next.rotation).norm() / dt : 0.0;
    const bool suspends = RateWhenExposed(rate, mean_rate_rad_s_) > most_rad_s_;
    mean_rate_rad_s_ = rate;
    return suspends;
  }

 private:
  double most_rad_s_;
  double mean_rate_rad_s_ = 0.0;  // up to the newest frame; 0 without encoders
};

}  // namespace saccade
