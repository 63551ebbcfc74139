#pragma once

#include <string>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// `camera` as a camera.yaml that LoadCamera reads back to the same numbers. `comment`, if any, is
/// its first line.
std::string CameraYaml(const CameraIntrinsics& camera, const std::string& comment = "");

}  // namespace saccade
