#pragma once

#include <compare>
#include <optional>
#include <string>

namespace saccade::view {

/// One face of a font file.
struct FontFile {
  std::string path;
  int index = 0;
  auto operator<=>(const FontFile&) const = default;
};

/// The system's font that has this character as an outline; nothing: none has. The main thread;
/// answers are kept.
std::optional<FontFile> FontWith(unsigned character);

}  // namespace saccade::view
