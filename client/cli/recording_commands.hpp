#pragma once

#include <absl/status/status.h>

#include <CLI/CLI.hpp>

#include "client/cli/options.hpp"
#include "client/net/connection.hpp"

namespace saccade::cli {

void AddRecording(CLI::App& app, Options& options);

/// `saccade recording start|stop|status`.
absl::Status RunRecording(const Options& options, net::Connection& connection);

/// `saccade playback status|play|pause|seek|speed`, of a server that plays a recording.
absl::Status RunPlayback(const Options& options, net::Connection& connection);

}  // namespace saccade::cli
