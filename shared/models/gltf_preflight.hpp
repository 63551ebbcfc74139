#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <string>

#include "shared/models/gltf_reader.hpp"

namespace saccade {

/// Checks the frame of a GLB file and, by its JSON alone, that it stays within `limits` and needs
/// nothing beside it; returns the file without pictures, which nobody here looks at. Errors as
/// ReadGlb.
absl::StatusOr<std::string> PreflightGlb(absl::string_view bytes, const GltfLimits& limits);

}  // namespace saccade
