#pragma once

#include <absl/status/status.h>

#include <Eigen/Dense>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/team/planar_robot.hpp"
#include "server/team/planar_start.hpp"
#include "server/team/team_filter.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// What came of the sightings so far.
struct PlanarCounts {
  std::size_t landmarks = 0;  // of known landmarks, used
  std::size_t mutual = 0;     // of robots by robots, used
  std::size_t waiting = 0;    // by or of a robot whose place is not known yet
  std::size_t doubted = 0;    // of the used ones: weight below a half
  std::size_t refused = 0;    // cannot be, from where things are thought to be
};

/// Wheeled robots in a plane in one joint filter: each drives by its own odometry, sees landmarks
/// at known places, and the others. What one sees of another corrects both, and whoever shares
/// knowledge with them (slam-spec 11). Calls come in order of time. One thread.
class PlanarTeam {
 public:
  explicit PlanarTeam(const PlanarOptions& options) : options_(options) {}

  /// A robot at a known pose (x, y [m], heading [rad] in world), to the options' start sigmas.
  /// AlreadyExists: it is there.
  absl::Status Place(int robot, const Eigen::Vector3d& pose, Timestamp time_ns);
  /// A robot that may be anywhere: it is placed by what it sees and by who sees it.
  absl::Status Join(int robot, Timestamp time_ns);
  /// It is gone; what the others learnt from it stays.
  void Leave(int robot);

  /// `robot` is told to move so from now on. Robots that are not there are passed over.
  void Odometry(int robot, Timestamp time_ns, const PlanarCommand& command);
  void SeeLandmark(int robot, Timestamp time_ns, int landmark, const Eigen::Vector2d& place,
                   const PlanarSight& sight);
  void SeeRobot(int robot, Timestamp time_ns, int other, const PlanarSight& sight);

  /// Where `robot` is at `time_ns`, not before the last call; nothing while that is not known.
  struct Belief {
    PlanarVector state;
    Eigen::Matrix3d covariance;  // of x, y, heading
  };
  std::optional<Belief> At(int robot, Timestamp time_ns);

  const PlanarCounts& counts() const { return counts_; }
  const TeamFilter& filter() const { return filter_; }

 private:
  struct Member {
    std::optional<PlanarRobot> placed;
    std::optional<PlanarStart> start;  // otherwise
  };

  Member* Ready(int robot, Timestamp time_ns);
  void Settle(int robot, Timestamp time_ns);
  void AddBlock(int robot, const Eigen::Vector3d& pose, double position_m, double heading_rad,
                const PlanarCommand& command, Timestamp time_ns);
  double SinceLast(int robot, int subject, Timestamp time_ns);
  void Count(const absl::StatusOr<BlockUpdate>& update, std::size_t& used);
  Eigen::Vector2d SeenPlace(const PlanarRobot& observer, const PlanarSight& sight) const;
  double PositionSigma(const PlanarRobot& robot) const;

  PlanarOptions options_;
  TeamFilter filter_;
  std::map<int, Member> members_;
  std::map<std::pair<int, int>, Timestamp> last_;  // of each pair, observer first
  PlanarCounts counts_;
};

}  // namespace saccade
