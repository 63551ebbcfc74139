#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "server/record/mcap_reader.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/map_snapshot.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

struct RecordedPose {
  Timestamp unix_ns = 0;  // exposure middle
  Rigid3 world_from_camera;
};

/// The map at one moment.
struct RecordedMap {
  std::vector<FeatureSnapshot> features;  // by rising id
  bool metric = false;
};

/// What people saw of the place at one moment.
struct RecordedScene {
  std::shared_ptr<const SurfaceSnapshot> surface;              // never null
  std::shared_ptr<const std::vector<Annotation>> annotations;  // never null
  bool metric = false;
};

/// A recording as what it is of: poses, and the map at any time. One thread.
class RecordingReader {
 public:
  /// Errors as McapReader's.
  static absl::StatusOr<std::unique_ptr<RecordingReader>> Open(const std::filesystem::path& file);

  McapReader& mcap() { return *mcap_; }
  /// Where the camera was placed, by rising time. DataLoss: damaged, or no recording of saccade's.
  absl::StatusOr<std::vector<RecordedPose>> Poses();
  /// As it was known then, from the last whole state before it. DataLoss: as above.
  absl::StatusOr<RecordedMap> MapAt(Timestamp unix_ns);
  /// Surfaces and marks as they were then. DataLoss: as above.
  absl::StatusOr<RecordedScene> SceneAt(Timestamp unix_ns);

 private:
  explicit RecordingReader(std::unique_ptr<McapReader> mcap) : mcap_(std::move(mcap)) {}

  const std::unique_ptr<McapReader> mcap_;
};

}  // namespace saccade
