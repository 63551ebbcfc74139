#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "shared/text/font_store.hpp"

namespace saccade {

inline constexpr std::size_t kNoFont = static_cast<std::size_t>(-1);

/// A glyph and where its origin is, on the line's baseline from its left end.
struct PlacedGlyph {
  std::size_t font = kNoFont;  // kNoFont: no font has it; an empty box is drawn
  std::uint32_t glyph = 0;
  double x_px = 0, y_px = 0;  // y down
};

struct TextLine {
  std::vector<PlacedGlyph> glyphs;  // left to right
  double width_px = 0;
  bool right_to_left = false;  // the paragraph's: it is set against the right
};

struct TextLayout {
  std::vector<TextLine> lines;
  double width_px = 0;  // of the widest line
  bool cut = false;     // there was more than `max_lines` hold: the last ends in an ellipsis
  int missing = 0;      // characters that no font has
};

struct LayoutOptions {
  int size_px = 14;  // of the em square
  double max_width_px = 1e9;
  int max_lines = 1;
};

/// Sets `utf8` (any bytes) in lines: fonts by character, shaped, right to left where it is written
/// so (first strong letter of each paragraph, Unicode's bidirectional algorithm), broken at blanks
/// or between ideographs, within a word only where a word is wider than a line. Linear in the text
/// but for its breaks; see DrawableText for what bounds it.
TextLayout LayOut(FontStore& fonts, std::string_view utf8, const LayoutOptions& options);

}  // namespace saccade
