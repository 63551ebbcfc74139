#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace saccade {

/// What people see as one character: a letter with its marks, a flag, a family of emoji.
struct Cluster {
  std::size_t begin = 0, end = 0;  // in the text, [begin, end)
  bool emoji = false;              // wants a colour font before any other
};

/// `utf8` as it may be drawn, at most 1200 code points of it. Malformed bytes become U+FFFD,
/// control characters blanks; what could turn the text round it about (U+202A to 202E, 2066 to
/// 2069) is left out, so that no text can disguise the words beside it. At most 30 marks on one
/// letter (UAX 15, stream-safe) and 8 line feeds are kept; further ones are dropped, or blanks.
std::u32string DrawableText(std::string_view utf8);

/// The clusters of `text` in order, without gaps (UAX 29, in short).
std::vector<Cluster> SplitClusters(std::u32string_view text);

/// Zero-width joiner, variation selectors and their like: no font needs a glyph for them.
bool IsIgnorable(char32_t c);

/// Whether a line may end between two neighbouring clusters (UAX 14, in short): after blanks and
/// hyphens, and between ideographs, but not before closing nor after opening punctuation.
bool MayBreakBetween(char32_t before, char32_t after);

}  // namespace saccade
