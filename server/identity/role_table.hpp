#pragma once

#include <absl/strings/string_view.h>
#include <absl/types/span.h>

#include <optional>

#include "server/identity/access.hpp"

namespace saccade {

/// One thing that can be asked of this server, and the least role that may ask it.
struct RoleRow {
  absl::string_view what;  // "SessionService/Join", or "GET /trust" of the gateway
  AccessRole least;
};

/// Every call of every service, and every path of the gateway: the only place that says who may
/// do what.
absl::Span<const RoleRow> RoleTable();

/// Nothing: not in the table, and so refused to everybody.
std::optional<AccessRole> LeastRole(absl::string_view what);

}  // namespace saccade
