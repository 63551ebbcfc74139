#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "server/capture/frame.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// Where a named object is and where it shows. The pixel is in the distorted picture; it is absent
/// if the point is behind the camera or beyond the lens.
struct SimObject {
  std::string name;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
  std::optional<Eigen::Vector2d> pixel;
  bool visible = false;  // in the picture and not hidden by anything
};

/// Exact truth of one frame at the middle of its exposure. Only tests and evaluation read it.
struct SimTruth {
  FrameId frame = 0;
  Timestamp capture_time_ns = 0;
  Rigid3 world_from_camera;
  MountAngles head;
  std::vector<SimObject> objects;
};

/// One line of `--sim-truth`; docs/design/simulator.md describes the fields.
std::string ToJsonLine(const SimTruth& truth);

/// Writes truth line by line; each line is complete on disk before the frame is handed out.
class SimTruthWriter {
 public:
  /// Replaces the file. NotFound or PermissionDenied name it.
  static absl::StatusOr<std::unique_ptr<SimTruthWriter>> Open(const std::filesystem::path& file);
  absl::Status Write(const SimTruth& truth);

 private:
  SimTruthWriter(std::ofstream stream, std::filesystem::path file)
      : stream_(std::move(stream)), file_(std::move(file)) {}
  std::ofstream stream_;
  std::filesystem::path file_;
};

}  // namespace saccade
