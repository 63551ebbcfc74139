#pragma once

#include <absl/status/status.h>

#include <CLI/CLI.hpp>
#include <string>

#include "client/cli/options.hpp"

namespace saccade::cli {

void AddTalk(CLI::App& app, Options& options);

bool IsTalkCommand(Command command);

/// say, messages, pause-picture. The session of the last run goes on, but for who follows and who
/// pauses: they join anew.
absl::Status RunTalk(const Options& options);

}  // namespace saccade::cli
