#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <filesystem>
#include <map>
#include <vector>

#include "server/team/planar_robot.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A recording of robots in a plane in the form of UTIAS MRCLAM (Leung et al., "The UTIAS
/// multi-robot cooperative localization and mapping dataset", IJRR 30(8), 2011).
struct MrclamOdometry {
  Timestamp time_ns = 0;
  PlanarCommand command;
};
struct MrclamSight {
  Timestamp time_ns = 0;
  int subject = 0;  // a robot from 1, or a landmark
  PlanarSight sight;
};
struct MrclamTruth {
  Timestamp time_ns = 0;
  Eigen::Vector3d pose;  // x, y [m], heading [rad]
};
struct MrclamRobot {
  std::vector<MrclamOdometry> odometry;
  std::vector<MrclamSight> sights;
  std::vector<MrclamTruth> truth;  // may be empty
};
struct MrclamData {
  std::vector<MrclamRobot> robots;           // robot k + 1
  std::map<int, Eigen::Vector2d> landmarks;  // [m in world]
  std::size_t unknown_codes = 0;             // sightings of a bar code that nothing has
};

/// Reads Barcodes.dat, Landmark_Groundtruth.dat and, for each robot from 1,
/// RobotN_{Odometry,Measurement}.dat and, if there, RobotN_Groundtruth.dat. Errors name file, line
/// and remedy: missing files, lines of another form, times that go back, codes or landmarks given
/// twice, negative ranges.
absl::StatusOr<MrclamData> LoadMrclam(const std::filesystem::path& folder);

/// Truth at `time_ns`, between two of its lines that are at most 0.3 s apart; else nothing.
std::optional<Eigen::Vector3d> TruthAt(const std::vector<MrclamTruth>& truth, Timestamp time_ns);

}  // namespace saccade
