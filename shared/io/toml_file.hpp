#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <filesystem>
#include <toml.hpp>

namespace saccade {

/// How deep arrays, tables and dotted keys may go in each other.
inline constexpr int kMaxTomlDepth = 64;

/// InvalidArgument: nested deeper than kMaxTomlDepth, with the line. Of text that is not TOML at
/// all it looks at no more than a parser would.
absl::Status CheckTomlDepth(absl::string_view text);

/// Parses a TOML file of at most 1 MiB. Errors as ReadRegularFile, and
///   InvalidArgument  not TOML, or nested too deep; the message begins with the file
/// Slow to compile: only where toml11 is used anyway.
absl::StatusOr<toml::value> ParseTomlFile(const std::filesystem::path& file);

}  // namespace saccade
