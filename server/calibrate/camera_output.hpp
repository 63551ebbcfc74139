#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>

#include "server/capture/camera_text.hpp"

namespace saccade {

/// Before a target is shown for minutes: whether its camera file could be written then.
///   AlreadyExists     there is a file
///   NotFound, PermissionDenied  nothing can be written there
absl::Status CheckCameraOut(const std::filesystem::path& out);

/// Writes `lens` as a new file, whole or not at all, and only if the server would read it.
///   AlreadyExists       made meanwhile; the camera is then in a file beside it
///   FailedPrecondition  the lens is none that can be, or the form has no words for it
absl::Status WriteCameraFile(const std::filesystem::path& out, CameraTextForm form,
                             const CameraIntrinsics& lens, const std::string& comment);

/// Writes `text`, a camera.yaml, over what is there, and makes the folder; whole or not at all.
///   FailedPrecondition  the server would not read it; says why
///   NotFound            nothing can be written there
absl::Status KeepCameraFile(const std::filesystem::path& file, const std::string& text);

}  // namespace saccade
