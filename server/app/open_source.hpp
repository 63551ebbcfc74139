#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>

#include "server/app/server_config.hpp"
#include "server/capture/frame_source.hpp"
#include "server/capture/phone/phone_source.hpp"
#include "server/mount/mount_registry.hpp"

namespace saccade {

/// Where frames come from, and what turns the camera.
struct OpenedSource {
  std::unique_ptr<FrameSource> source;
  OpenedMount mount;
  PhoneSource* phone = nullptr;  // the source, where that is a phone
};

/// Where the camera file of this source is kept that a calibration made (docs/calibration.md);
/// empty: nowhere, as a phone's is another with every phone.
std::filesystem::path KeptCameraFile(const ServerConfig& config);

/// The source and the mount that the configuration names, of every scheme this program links.
absl::StatusOr<OpenedSource> OpenConfiguredSource(const ServerConfig& config);

}  // namespace saccade
