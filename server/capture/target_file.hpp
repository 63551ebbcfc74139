#pragma once

#include <absl/status/statusor.h>

#include <filesystem>

#include "server/capture/target.hpp"

namespace saccade {

/// Reads `target.yaml` and the templates beside it. Errors name file, line, field and remedy.
absl::StatusOr<Target> LoadTarget(const std::filesystem::path& file);

/// Reads `start.yaml`: world_from_camera at frame 0.
absl::StatusOr<StartPose> LoadStart(const std::filesystem::path& file);

}  // namespace saccade
