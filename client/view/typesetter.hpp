#pragma once

#include <imgui.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "shared/text/font_store.hpp"
#include "shared/text/text_layout.hpp"

namespace saccade::view {

/// Words as ImGui can show them, which sets each character for itself, left to right, up to U+FFFF.
/// Where that is not how something is written (Arabic, Hebrew, Devanagari, marks on letters, emoji)
/// `shared/text` sets it, and each glyph becomes a character of its own in the font, in the
/// private use area. The thread that draws.
class Typesetter {
 public:
  Typesetter();

  /// `utf8` (any bytes), in the order in which it is seen, in lines no wider than `width_px` where
  /// that is above 0. What is simple comes back as it is. A blank where a glyph is not in the font
  /// yet: it will be in the next picture.
  std::string Set(const std::string& utf8, float width_px = 0);
  /// For a field that is written in, and back: what is beyond U+FFFF has a character of its own
  /// there. ToField() of a text that came from FromField() is that text again.
  std::string ToField(const std::string& utf8);
  std::string FromField(const std::string& field) const;
  /// What a keyboard brought, for a field.
  ImWchar ToField(char32_t character);

  /// False if a field shows it otherwise than it is written.
  static bool IsSimple(const std::string& utf8);

  /// There are glyphs that the font has not.
  bool stale() const { return stale_; }
  /// Of the em square [px]; forgets all glyphs if it is another one.
  void SetSize(int em_px);
  /// Makes room in the atlas, before it is built.
  void Reserve(ImFontAtlas& atlas);
  /// Draws what there is room for, after it was built, and adds it to `fonts`.
  void Draw(ImFontAtlas& atlas, const std::vector<ImFont*>& fonts);

 private:
  /// Glyph, how far below the line, and from its beginning to the next one's [px].
  using Glyph = std::tuple<std::size_t, std::uint32_t, int, int>;
  struct Kept {
    Glyph glyph;
    ImWchar character = 0;
    GlyphPicture picture;
    int reserved = -1;  // its rectangle in the atlas
  };
  ImWchar CharacterOf(const Glyph& glyph, ImWchar wanted = 0);
  /// Of the private use area, not taken yet; its end where all are.
  ImWchar Free();
  std::string Line(const TextLine& line, double right_px);
  /// A character that stands by itself; nothing if it has no sign.
  std::optional<Glyph> Alone(char32_t character);
  GlyphPicture PictureOf(const Glyph& glyph);

  FontStore fonts_;
  int em_px_ = 12;
  std::vector<Kept> kept_;
  std::map<std::pair<Glyph, ImWchar>, ImWchar> known_;
  struct Text {
    std::string set;
    int since = 0;  // generation of the font from which on it has all of it
  };
  std::map<std::pair<std::string, int>, Text> set_;  // shown of late
  std::map<char32_t, ImWchar> in_field_;
  std::map<ImWchar, char32_t> from_field_;
  ImWchar next_;
  int generation_ = 0;
  bool stale_ = false;
};

/// The one of the window.
Typesetter& Types();

}  // namespace saccade::view
