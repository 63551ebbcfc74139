#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <optional>
#include <string>

#include "server/identity/identity_provider.hpp"

namespace saccade {

/// [oidc] of the server's file, with [oidc.roles]. Nothing: the file has none, and nobody signs in.
/// InvalidArgument names file and key.
absl::StatusOr<std::optional<IdentityProviderOptions>> LoadOidc(const std::filesystem::path& file);

/// The table as --print-config shows it.
std::string DescribeOidc();

}  // namespace saccade
