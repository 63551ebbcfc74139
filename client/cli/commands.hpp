#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include "client/cli/options.hpp"
#include "client/net/connection.hpp"

namespace saccade::cli {

/// Runs one command against a server and prints its answer to stdout. Errors are the caller's to
/// print.
absl::Status Run(const Options& options, net::Connection& connection);

// One per group of commands; Run() picks.
absl::Status RunStatus(const Options& options, net::Connection& connection);
absl::Status RunWatch(const Options& options, net::Connection& connection);
absl::Status RunMap(const Options& options, net::Connection& connection);
absl::Status RunSnapshot(const Options& options, net::Connection& connection);
absl::Status RunAnnotate(const Options& options, net::Connection& connection);
absl::Status RunAnnotations(const Options& options, net::Connection& connection);
absl::Status RunGaze(const Options& options, net::Connection& connection);
absl::Status RunCalibrateMount(const Options& options, net::Connection& connection);

/// The whole file or none: what could not be finished is removed.
absl::Status WriteFile(const std::string& path, const std::string& data);
/// The lease's id. Unavailable: somebody else pilots.
absl::StatusOr<std::string> TakeLease(net::Connection& connection);

}  // namespace saccade::cli
