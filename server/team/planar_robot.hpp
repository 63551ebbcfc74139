#pragma once

#include <Eigen/Dense>
#include <optional>

#include "server/team/team_filter.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// Numbers of a wheeled robot's block: pose in a plane, then what is wrong with its sensors.
enum PlanarIndex : int {
  kX,             // [m] in world
  kY,             // [m]
  kHeading,       // [rad] from world x, not wrapped
  kSpeedScale,    // true speed = (1 + it) * reported
  kTurnScale,     // true turn rate = (1 + it) * reported + kTurnBias
  kTurnBias,      // [rad/s] while it drives
  kRangeBias,     // [m] measured - true
  kBearingBias,   // [rad] measured - true
  kSightDelay_s,  // a sighting was made so long before its time stamp
  kPlanarDim
};
using PlanarVector = Eigen::Matrix<double, kPlanarDim, 1>;
using PlanarMatrix = Eigen::Matrix<double, kPlanarDim, kPlanarDim>;

/// What is believed of robots before anything is measured. Sigmas; of a small differential drive
/// whose odometry is what it was told to do, and of a camera that reads bar codes.
struct PlanarOptions {
  double start_position_m = 0.05, start_heading_rad = 0.05;
  double speed_scale = 0.1, turn_scale = 0.1, turn_bias_rad_s = 0.01;
  double range_bias_m = 0.05, bearing_bias_rad = 0.02, sight_delay_s = 0.15;
  /// Of motion, each per square root of a second that it drives; a tenth while it stands.
  double along_m = 0.02, across_m = 0.01, turn_rad = 0.03;
  /// Of a sighting: range by sqrt(range_m^2 + (range_part * range)^2).
  double range_m = 0.05, range_part = 0.06, bearing_rad = 0.02;
  /// Errors of one pair's sightings last so long: those that follow sooner tell less.
  double correlation_s = 1.0;
  double student_dof = 4.0;
  /// A robot placed by what it sees, or by who sees it, is then taken to be known so well.
  double placed_position_m = 0.5, placed_heading_rad = 0.3;
};

/// Speed forward [m/s] and turn rate to the left [rad/s].
struct PlanarCommand {
  double speed_m_s = 0.0, turn_rad_s = 0.0;
  bool moves() const { return speed_m_s != 0.0 || turn_rad_s != 0.0; }
};

/// Range [m] and bearing [rad, to the left of ahead] of something.
struct PlanarSight {
  double range_m = 0.0, bearing_rad = 0.0;
};

/// Moves `state` on for `dt_s` along an arc; with `transition` and `noise`, those of its errors.
void DrivePlanar(double dt_s, const PlanarCommand& command, const PlanarOptions& options,
                 PlanarVector& state, PlanarMatrix* transition = nullptr,
                 PlanarMatrix* noise = nullptr);

/// Residual of a sighting by a robot, with its Jacobians with respect to the observer's numbers and
/// to the subject's position (world) at the sighting's time stamp; `subject_velocity` [m/s in
/// world] is taken as known. Nothing if the two are in one place.
struct PlanarResidual {
  Eigen::Vector2d residual;  // measured - expected: range, bearing
  Eigen::Matrix<double, 2, kPlanarDim> d_observer;
  Eigen::Matrix2d d_subject;
};
std::optional<PlanarResidual> ResidualOf(const PlanarSight& sight, const PlanarVector& observer,
                                         const PlanarCommand& command,
                                         const Eigen::Vector2d& subject,
                                         const Eigen::Vector2d& subject_velocity);

/// Covariance of range and bearing; `since_s`: time since the pair's last sighting.
Eigen::Matrix2d SightNoise(const PlanarSight& sight, double since_s, const PlanarOptions& options);

/// Velocity in world [m/s] at the scale that `state` believes.
Eigen::Vector2d VelocityOf(const PlanarVector& state, const PlanarCommand& command);

/// One robot's block in a filter, and the odometry that the filter has not been told of yet: many
/// small steps reach it as one.
class PlanarRobot {
 public:
  PlanarRobot(BlockId block, Timestamp now_ns) : block_(block), now_ns_(now_ns) {}

  BlockId block() const { return block_; }
  Timestamp now_ns() const { return now_ns_; }
  const PlanarCommand& command() const { return command_; }

  /// To `time_ns` with what was last commanded; a time that is past changes nothing.
  void Advance(Timestamp time_ns, const PlanarOptions& options, TeamFilter& filter);
  void Command(const PlanarCommand& command) { command_ = command; }
  /// Tells `filter` of all motion until now.
  void Tell(TeamFilter& filter);

 private:
  BlockId block_;
  Timestamp now_ns_;
  PlanarCommand command_;
  bool pending_ = false;
  PlanarVector state_;
  PlanarMatrix transition_, noise_;
};

}  // namespace saccade
