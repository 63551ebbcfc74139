#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

struct StampedPose {
  Timestamp time_ns = 0;
  Rigid3 world_from_camera;
};

/// Poses in order of time, strictly increasing.
using Trajectory = std::vector<StampedPose>;

/// Reads a TUM file: `timestamp tx ty tz qx qy qz qw`, metres, Hamilton, comments with #.
/// An empty file gives an empty trajectory. Errors name file, line and remedy.
absl::StatusOr<Trajectory> LoadTrajectory(const std::filesystem::path& file);

/// One line of a TUM file, with its newline; the time stamp as given.
std::string TumLine(const std::string& timestamp, const Rigid3& world_from_camera);

/// The pose at `time_ns`. Between two poses no further apart than `max_gap_ns` it is interpolated
/// (position linearly, rotation by slerp); otherwise the nearest within `max_distance_ns`, or
/// nothing.
std::optional<Rigid3> PoseAt(const Trajectory& trajectory, Timestamp time_ns, Timestamp max_gap_ns,
                             Timestamp max_distance_ns);

/// Median interval between poses [ns]; 0 for fewer than two.
Timestamp MedianInterval(const Trajectory& trajectory);

}  // namespace saccade
