#pragma once

#include <absl/status/status.h>

#include <CLI/CLI.hpp>

#include "client/cli/options.hpp"

namespace saccade::cli {

/// Flags of how a server is reached, and the commands trust, invite, invites, revoke, audit,
/// waiting and admit.
void AddAccess(CLI::App& app, Options& options);

bool IsAccessCommand(Command command);
/// Runs one of them and prints its answer. Errors are the caller's to print.
absl::Status RunAccess(const Options& options);

}  // namespace saccade::cli
