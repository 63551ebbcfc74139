#pragma once

#include <absl/status/status.h>

#include <CLI/CLI.hpp>

#include "client/cli/options.hpp"

namespace saccade::cli {

void AddScene(CLI::App& app, Options& options);

bool IsSceneCommand(Command command);

/// scene list, add, place, remove, register; in the session of the last run.
absl::Status RunScene(const Options& options);

}  // namespace saccade::cli
