#include "shared/io/toml_file.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <sstream>
#include <string>

#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 20;

/// Where the comment or string that begins at `at` ends (one past it), as TOML 1.0 has them. `at`
/// + 1 where nothing begins.
std::size_t SkipToken(absl::string_view text, std::size_t at) {
  const char c = text[at];
  if (c == '#') return std::min(text.find('\n', at), text.size());
  if (c != '"' && c != '\'') return at + 1;
  const std::string mark(text.substr(at, 3) == std::string(3, c) ? 3 : 1, c);
  for (std::size_t i = at + mark.size(); i < text.size(); ++i) {
    if (c == '"' && text[i] == '\\') {
      ++i;
    } else if (absl::StartsWith(text.substr(i), mark)) {
      i += mark.size();
      // Up to two more quotes belong to what a long string holds.
      for (int more = 0; mark.size() == 3 && more < 2 && i < text.size() && text[i] == c; ++more) {
        ++i;
      }
      return i;
    } else if (mark.size() == 1 && text[i] == '\n') {
      return i;  // not TOML: the parser stops here
    }
  }
  return text.size();
}

}  // namespace

absl::Status CheckTomlDepth(absl::string_view text) {
  int depth = 0, dots = 0, line = 1;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '[' || c == '{') ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (c == '.') ++dots;  // a.b.c is a table in a table
    if (c == '[' || c == '{' || c == ']' || c == '}' || c == ',' || c == '=' || c == '\n') dots = 0;
    if (depth + dots > kMaxTomlDepth) {
      return absl::InvalidArgumentError(absl::StrCat("line ", line, ": nested more than ",
                                                     kMaxTomlDepth,
                                                     " deep; is it a configuration file?"));
    }
    const std::size_t next = SkipToken(text, at);
    line += static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(at),
                                        text.begin() + static_cast<std::ptrdiff_t>(next), '\n'));
    at = next;
  }
  return absl::OkStatus();
}

absl::StatusOr<toml::value> ParseTomlFile(const std::filesystem::path& file) {
  absl::StatusOr<std::string> text = ReadRegularFile(file, kMaxBytes, "a TOML file");
  if (!text.ok()) return text.status();
  const auto bad = [&file](absl::string_view problem) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", problem));
  };
  if (absl::Status depth = CheckTomlDepth(*text); !depth.ok()) return bad(depth.message());
  try {
    std::istringstream stream(*std::move(text));
    return toml::parse(stream, file.string());
  } catch (const std::exception& error) {
    return bad(error.what());
  }
}

}  // namespace saccade
