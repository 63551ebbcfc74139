#pragma once

#include <absl/status/status.h>

#include "client/cli/options.hpp"

namespace CLI {
class App;
}

namespace saccade::cli {

/// `saccade cameras|record|calibrate-camera|markers print`, which need no server.
void AddMachine(CLI::App& app, Options& options);

/// `saccade record`: becomes `saccade-eval record`, which lies beside this program and links the
/// sources. Returns only if that cannot be.
absl::Status RunRecord(const Options& options);

/// Becomes `saccade-eval calibrate-camera` likewise.
absl::Status RunCalibrateCamera(const Options& options);

/// Becomes `saccade-eval replay` likewise.
absl::Status RunReplay(const Options& options);

/// Becomes `saccade-eval print-markers` likewise.
absl::Status RunPrintMarkers(const Options& options);

}  // namespace saccade::cli
