#pragma once

#include <absl/status/status.h>

#include <CLI/CLI.hpp>

#include "client/cli/options.hpp"
#include "client/net/connection.hpp"

namespace saccade::cli {

void AddMaps(CLI::App& app, Options& options);

/// `saccade maps list`, and save, load, delete, export, import.
absl::Status RunMaps(const Options& options, net::Connection& connection);

}  // namespace saccade::cli
