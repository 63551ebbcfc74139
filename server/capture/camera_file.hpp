#pragma once

#include <absl/status/statusor.h>

#include <filesystem>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// Reads `camera.yaml` (architecture, section 4).
///   NotFound         no such file
///   InvalidArgument  unknown lens model, wrong number of coefficients, a number that is missing,
///   not
///                    finite or out of range, an unknown field: file, line, field and remedy
absl::StatusOr<CameraIntrinsics> LoadCamera(const std::filesystem::path& file);

}  // namespace saccade
