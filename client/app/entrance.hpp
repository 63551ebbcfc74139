#pragma once

#include <absl/status/statusor.h>

#include <functional>

#include "client/app/options.hpp"
#include "client/net/connection.hpp"

namespace saccade::app {

/// What a session does before it joins: trust and token as `saccade` finds and keeps them, the
/// invite redeemed once, whether one still waits to be let in. For one thread.
std::function<absl::StatusOr<bool>(net::ConnectionOptions&)> MakeEntrance(const Options& options,
                                                                          const Address& address);

}  // namespace saccade::app
