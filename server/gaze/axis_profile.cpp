#include "server/gaze/axis_profile.hpp"

#include <algorithm>

#include "server/mount/approach.hpp"

namespace saccade {

void AxisProfile::Follow(double goal, double goal_rate, const AxisLimits& limits, double dt) {
  const double target = std::clamp(goal, limits.least, limits.most);
  if (target != goal) goal_rate = 0;
  // The goal is that of the step's end; so is the place compared with it.
  const double error = target - (angle + rate * dt);
  const double wanted =
      std::clamp(goal_rate + ApproachRate(error, 0.9 * limits.acceleration, limits.gain_per_s),
                 -limits.rate, limits.rate);
  const double before = rate;
  rate += std::clamp(wanted - rate, -limits.acceleration * dt, limits.acceleration * dt);
  angle += 0.5 * (before + rate) * dt;
  if (angle >= limits.least && angle <= limits.most) return;
  angle = std::clamp(angle, limits.least, limits.most);
  rate = 0;
}

void AxisProfile::Brake(const AxisLimits& limits, double dt) {
  const double before = rate;
  rate -= std::clamp(rate, -limits.acceleration * dt, limits.acceleration * dt);
  angle = std::clamp(angle + 0.5 * (before + rate) * dt, limits.least, limits.most);
}

}  // namespace saccade
