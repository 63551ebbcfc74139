#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <optional>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// ResourceExhausted that passes by itself: `message`, then "try again in ... s". Clients of the
/// API read the time from google.rpc.RetryInfo, which the status carries as a payload.
absl::Status BusyError(absl::string_view message, Timestamp retry_after_ns);

/// The google.rpc.RetryInfo of such a status, encoded; nothing in any other.
std::optional<std::string> RetryInfoOf(const absl::Status& status);
/// When to try again [ns from when it was made]; 0 of any other.
Timestamp RetryAfterOf(const absl::Status& status);

}  // namespace saccade
