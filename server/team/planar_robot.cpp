#include "server/team/planar_robot.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {

void DrivePlanar(double dt_s, const PlanarCommand& command, const PlanarOptions& options,
                 PlanarVector& state, PlanarMatrix* transition, PlanarMatrix* noise) {
  const bool moves = command.moves();
  const double turn =
      command.turn_rad_s * (1.0 + state[kTurnScale]) + (moves ? state[kTurnBias] : 0.0);
  const double length = command.speed_m_s * (1.0 + state[kSpeedScale]) * dt_s;
  const double middle = state[kHeading] + 0.5 * turn * dt_s;
  const double half = 0.5 * turn * dt_s;
  // The chord of an arc is shorter than the arc.
  const double chord =
      length * (std::abs(half) < 1e-4 ? 1.0 - half * half / 6 : std::sin(half) / half);
  const double c = std::cos(middle), s = std::sin(middle);
  state[kX] += chord * c;
  state[kY] += chord * s;
  state[kHeading] += turn * dt_s;
  if (transition != nullptr) {
    PlanarMatrix& f = *transition;
    f.setIdentity();
    const Eigen::Vector2d by_heading(-chord * s, chord * c);
    const double shrink = std::abs(half) < 1e-4
                              ? -half / 3
                              : (half * std::cos(half) - std::sin(half)) / (half * half);
    const Eigen::Vector2d by_turn =
        0.5 * dt_s * (by_heading + length * shrink * Eigen::Vector2d(c, s));
    f.block<2, 1>(kX, kHeading) = by_heading;
    f.block<2, 1>(kX, kSpeedScale) =
        command.speed_m_s * dt_s * chord / (length == 0.0 ? 1.0 : length) * Eigen::Vector2d(c, s);
    f.block<2, 1>(kX, kTurnScale) = command.turn_rad_s * by_turn;
    f(kHeading, kTurnScale) = command.turn_rad_s * dt_s;
    if (moves) {
      f.block<2, 1>(kX, kTurnBias) = by_turn;
      f(kHeading, kTurnBias) = dt_s;
    }
  }
  if (noise != nullptr) {
    const double part = (moves ? 1.0 : 0.01) * dt_s;
    const Eigen::Matrix2d turned = Eigen::Rotation2Dd(middle).toRotationMatrix();
    const Eigen::Vector2d own(options.along_m * options.along_m,
                              options.across_m * options.across_m);
    noise->setZero();
    noise->block<2, 2>(kX, kX) = part * turned * own.asDiagonal() * turned.transpose();
    (*noise)(kHeading, kHeading) = part * options.turn_rad * options.turn_rad;
  }
}

Eigen::Vector2d VelocityOf(const PlanarVector& state, const PlanarCommand& command) {
  return command.speed_m_s * (1.0 + state[kSpeedScale]) *
         Eigen::Vector2d(std::cos(state[kHeading]), std::sin(state[kHeading]));
}

std::optional<PlanarResidual> ResidualOf(const PlanarSight& sight, const PlanarVector& observer,
                                         const PlanarCommand& command,
                                         const Eigen::Vector2d& subject,
                                         const Eigen::Vector2d& subject_velocity) {
  const double turn = command.turn_rad_s * (1.0 + observer[kTurnScale]);
  const Eigen::Vector2d own_velocity = VelocityOf(observer, command);
  const Eigen::Vector2d relative = subject_velocity - own_velocity;
  const Eigen::Vector2d to = subject - observer.head<2>() - observer[kSightDelay_s] * relative;
  const double range = to.norm();
  if (!(range > 1e-3)) return std::nullopt;
  const double heading = observer[kHeading] - observer[kSightDelay_s] * turn;
  PlanarResidual out;
  out.residual.x() = sight.range_m - range - observer[kRangeBias];
  out.residual.y() = std::remainder(
      sight.bearing_rad - observer[kBearingBias] - (std::atan2(to.y(), to.x()) - heading),
      2 * M_PI);
  Eigen::Matrix2d by_to;  // of range and bearing
  by_to << to.transpose() / range, -to.y() / (range * range), to.x() / (range * range);
  auto& j = out.d_observer;
  j.setZero();
  j.leftCols<2>() = -by_to;
  j.col(kHeading) =
      by_to * observer[kSightDelay_s] * Eigen::Vector2d(-own_velocity.y(), own_velocity.x());
  j(1, kHeading) -= 1.0;
  const double scale = 1.0 + observer[kSpeedScale];
  if (scale != 0.0) j.col(kSpeedScale) = by_to * observer[kSightDelay_s] * own_velocity / scale;
  j(1, kTurnScale) = observer[kSightDelay_s] * command.turn_rad_s;
  j(0, kRangeBias) = 1.0;
  j(1, kBearingBias) = 1.0;
  j.col(kSightDelay_s) = -by_to * relative;
  j(1, kSightDelay_s) += turn;
  out.d_subject = by_to;
  return out;
}

Eigen::Matrix2d SightNoise(const PlanarSight& sight, double since_s, const PlanarOptions& options) {
  // White noise that tells as much as one whose errors last for correlation_s.
  const double repeated =
      since_s > 0 ? std::max(1.0, 2.0 * options.correlation_s / std::max(since_s, 0.02)) : 1.0;
  const double part = options.range_part * sight.range_m;
  return repeated * Eigen::Vector2d(options.range_m * options.range_m + part * part,
                                    options.bearing_rad * options.bearing_rad)
                        .asDiagonal()
                        .toDenseMatrix();
}

void PlanarRobot::Advance(Timestamp time_ns, const PlanarOptions& options, TeamFilter& filter) {
  if (time_ns <= now_ns_) return;
  if (!pending_) {
    pending_ = true;
    state_ = filter.state(block_).numbers;
    transition_.setIdentity();
    noise_.setZero();
  }
  PlanarMatrix step, added;
  DrivePlanar(Seconds(time_ns - now_ns_), command_, options, state_, &step, &added);
  now_ns_ = time_ns;
  transition_ = (step * transition_).eval();
  noise_ = (step * noise_ * step.transpose() + added).eval();
}

void PlanarRobot::Tell(TeamFilter& filter) {
  if (!pending_) return;
  pending_ = false;
  // Sizes fit and numbers are finite by construction.
  filter.Predict(block_, {std::nullopt, state_}, transition_, noise_).IgnoreError();
}

}  // namespace saccade
