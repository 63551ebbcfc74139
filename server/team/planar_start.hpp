#pragma once

#include <Eigen/Dense>
#include <deque>
#include <optional>

#include "server/team/planar_robot.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// Finds where a robot is of which nothing is known, from what it sees at known places and from who
/// sees it, along its odometry; waits while more than one answer remains. One thread.
class PlanarStart {
 public:
  PlanarStart(const PlanarOptions& options, Timestamp now_ns)
      : options_(options), now_ns_(now_ns) {}

  void Advance(Timestamp time_ns);
  void Command(const PlanarCommand& command) { command_ = command; }
  /// It sees something at `place` [m in world], known to `sigma_m`.
  void Sees(const PlanarSight& sight, const Eigen::Vector2d& place, double sigma_m);
  /// It is seen at `place`, known to `sigma_m`.
  void SeenAt(const Eigen::Vector2d& place, double sigma_m);

  /// Pose (x, y, heading) in world now, once there is but one.
  std::optional<Eigen::Vector3d> Pose() const;
  const PlanarCommand& command() const { return command_; }

 private:
  struct Clue {
    Timestamp time_ns;
    Eigen::Vector3d own;    // robot's pose then in the frame of the start
    Eigen::Vector2d place;  // in world
    std::optional<PlanarSight> sight;
    double sigma_m;
  };
  struct Answer {
    Eigen::Vector3d world_from_own;
    double cost = 0.0;
    Eigen::Matrix3d information;
  };

  void Add(Clue clue);
  Answer Solve(double heading) const;

  PlanarOptions options_;
  Timestamp now_ns_;
  PlanarCommand command_;
  PlanarVector own_ = PlanarVector::Zero();
  std::deque<Clue> clues_;
};

}  // namespace saccade
