#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <string>

#include "client/cli/options.hpp"
#include "client/net/access_client.hpp"

namespace saccade::cli {

/// `saccade waiting`: who waits to be let in.
absl::Status RunWaiting(const Options& options, net::AccessClient& client);
/// `saccade admit WHO [--refuse]`.
absl::Status RunAdmit(const Options& options, net::AccessClient& client);

/// In this machine's time zone, "2026-11-29 23:05".
std::string TimeText(std::int64_t unix_s);

}  // namespace saccade::cli
