#pragma once

#include <absl/status/status.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/options.hpp"
#include "shared/io/video_modes.hpp"

namespace saccade::cli {

/// `saccade cameras`: the video devices of this machine; asks no server.
absl::Status RunCameras(const Options& options);

std::string CamerasText(const std::vector<ListedVideoDevice>& devices);
nlohmann::json CamerasJson(const std::vector<ListedVideoDevice>& devices);

}  // namespace saccade::cli
