#pragma once

#include <cmath>

namespace saccade {

/// Rate at which to close `error` so that it ends without overshoot, decelerating by at most
/// `acceleration`: exponential (rate = gain * error) near the end, the braking parabola before it,
/// joined where the exponential's deceleration gain^2 * error reaches the limit.
inline double ApproachRate(double error, double acceleration, double gain) {
  const double distance = std::abs(error);
  const double joined = acceleration / (gain * gain);
  const double rate = distance <= joined ? gain * distance
                                         : std::sqrt(2 * acceleration * (distance - 0.5 * joined));
  return std::copysign(rate, error);
}

}  // namespace saccade
