#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "server/app/server_config.hpp"
#include "server/capture/frame_source.hpp"

namespace saccade {

/// The source that the configuration names, of every scheme this program links.
absl::StatusOr<std::unique_ptr<FrameSource>> OpenConfiguredSource(const ServerConfig& config);

}  // namespace saccade
