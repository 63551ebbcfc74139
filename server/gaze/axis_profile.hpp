#pragma once

namespace saccade {

/// Limits of one joint's motion [rad, s].
struct AxisLimits {
  double rate = 0, acceleration = 0, gain_per_s = 0, least = 0, most = 0;
};

/// The demanded motion of one joint: follows a moving goal within limits of rate and acceleration,
/// without overshoot over a goal that stands still. Pure: state and time step in, state out.
struct AxisProfile {
  double angle = 0, rate = 0;

  /// One step of `dt` seconds towards `goal`, the place to be at the step's end, which itself moves
  /// at `goal_rate`.
  void Follow(double goal, double goal_rate, const AxisLimits& limits, double dt);
  /// One step of coming to rest.
  void Brake(const AxisLimits& limits, double dt);
};

}  // namespace saccade
