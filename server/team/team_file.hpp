#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A camera of a robot (`pose`: robot_from_camera) or one that stands still (`pose`:
/// world_from_camera; absent: it finds its place by what it sees).
struct TeamCamera {
  std::string name, source;
  std::filesystem::path lens;  // camera.yaml; empty: the source's own
  std::optional<Rigid3> pose;
};

/// A square marker on a robot (`pose`: robot_from_marker, required) or in a room (`pose`:
/// world_from_marker; absent: found).
struct TeamMarker {
  std::string family;
  int id = 0;
  double side_m = 0.0;
  std::optional<Rigid3> pose;
};

struct TeamRobot {
  std::string name, source, mount = "none", model = "agile";
  std::vector<TeamCamera> cameras;
  std::vector<TeamMarker> markers;
};

/// team.toml: who and what is in one filter.
///
///   [[robot]] name = "anna" source = "v4l2:/dev/video0" mount = "none" model = "agile"
///   [[robot.camera]] name = "left" source = "..." lens = "left.yaml" pose = [x y z qx qy qz qw]
///   [[robot.marker]] family = "apriltag36h11" id = 3 side_m = 0.12 pose = [...]
///   [[camera]] name source lens pose      [[marker]] family id side_m pose
///
/// Metres; quaternions of length 1 to one part in a hundred. A relative `lens` is beside the file.
struct TeamDescription {
  std::vector<TeamRobot> robots;
  std::vector<TeamCamera> cameras;
  std::vector<TeamMarker> markers;
};

/// Errors as ParseTomlFile, and InvalidArgument naming file, field ("robot[1].model") and remedy:
/// unknown or missing keys, values of another type or out of range, a name or a marker given twice,
/// nobody at all.
absl::StatusOr<TeamDescription> LoadTeam(const std::filesystem::path& file);

}  // namespace saccade
