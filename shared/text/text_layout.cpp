#include "shared/text/text_layout.hpp"

#include <fribidi.h>

#include <algorithm>
#include <memory>

#include "shared/text/characters.hpp"

namespace saccade {
namespace {

constexpr double kGlyphUnit = 64.0;   // HarfBuzz's, of a pixel
constexpr double kBoxAdvance = 0.62;  // of a character without a font, in ems

using Buffer = std::unique_ptr<hb_buffer_t, decltype(&hb_buffer_destroy)>;

/// A paragraph, or a line of one: what is known of each of its characters.
struct Characters {
  std::u32string text;
  std::vector<FriBidiLevel> level;
  std::vector<std::size_t> font;
  std::vector<hb_script_t> script;
  std::vector<bool> begins;  // a cluster
  bool right_to_left = false;

  Characters Slice(std::size_t begin, std::size_t end) const {
    const auto part = [begin, end](const auto& all) {
      return std::decay_t<decltype(all)>(all.begin() + static_cast<std::ptrdiff_t>(begin),
                                         all.begin() + static_cast<std::ptrdiff_t>(end));
    };
    return {part(text), part(level), part(font), part(script), part(begins), right_to_left};
  }
};

void FindLevels(Characters& all) {
  const auto n = static_cast<FriBidiStrIndex>(all.text.size());
  const std::vector<FriBidiChar> text(all.text.begin(), all.text.end());
  std::vector<FriBidiCharType> types(text.size());
  std::vector<FriBidiBracketType> brackets(text.size());
  fribidi_get_bidi_types(text.data(), n, types.data());
  fribidi_get_bracket_types(text.data(), n, types.data(), brackets.data());
  FriBidiParType direction = FRIBIDI_PAR_ON;  // by the first strong letter
  all.level.assign(text.size(), 0);
  if (fribidi_get_par_embedding_levels_ex(types.data(), brackets.data(), n, &direction,
                                          all.level.data()) == 0) {
    std::fill(all.level.begin(), all.level.end(), FriBidiLevel{0});
  }
  all.right_to_left = FRIBIDI_IS_RTL(direction);
}

/// Marks, digits and punctuation belong to the script before them.
void FindScripts(Characters& all) {
  hb_script_t current = HB_SCRIPT_LATIN;
  for (const char32_t c : all.text) {
    const hb_script_t script = hb_unicode_script(hb_unicode_funcs_get_default(), c);
    if (script != HB_SCRIPT_COMMON && script != HB_SCRIPT_INHERITED) current = script;
    all.script.push_back(current);
  }
}

Characters Analyse(const FontCatalogue& catalogue, std::u32string text, int& missing) {
  Characters all;
  all.text = std::move(text);
  FindLevels(all);
  FindScripts(all);
  all.font.assign(all.text.size(), kNoFont);
  all.begins.assign(all.text.size(), false);
  for (const Cluster& cluster : SplitClusters(all.text)) {
    all.begins[cluster.begin] = true;
    const std::u32string_view whole(&all.text[cluster.begin], cluster.end - cluster.begin);
    const std::optional<std::size_t> font = catalogue.FontFor(whole, cluster.emoji);
    if (!font && !IsIgnorable(whole.front())) ++missing;
    std::fill(all.font.begin() + static_cast<std::ptrdiff_t>(cluster.begin),
              all.font.begin() + static_cast<std::ptrdiff_t>(cluster.end), font.value_or(kNoFont));
  }
  return all;
}

/// [begin, end) of one font, script and level.
struct Run {
  std::size_t begin = 0, end = 0;
  std::vector<PlacedGlyph> glyphs;  // from the run's left end
  std::vector<double> advance_px;   // of each character, in order of the text
  double width_px = 0;
};

void ShapeBoxes(const Characters& all, const LayoutOptions& options, Run& run) {
  for (std::size_t i = run.begin; i < run.end; ++i) {
    if (!all.begins[i] || IsIgnorable(all.text[i])) continue;
    run.glyphs.push_back({kNoFont, 0, run.width_px, 0});
    run.advance_px[i - run.begin] = kBoxAdvance * options.size_px;
    run.width_px += kBoxAdvance * options.size_px;
  }
}

void Shape(FontStore& fonts, const Characters& all, const LayoutOptions& options, Run& run) {
  run.advance_px.assign(run.end - run.begin, 0.0);
  const std::size_t font = all.font[run.begin];
  hb_font_t* shaper = font == kNoFont ? nullptr : fonts.Shaper(font, options.size_px);
  if (shaper == nullptr) return ShapeBoxes(all, options, run);
  const Buffer buffer(hb_buffer_create(), &hb_buffer_destroy);
  hb_buffer_add_utf32(buffer.get(), reinterpret_cast<const std::uint32_t*>(all.text.data()),
                      static_cast<int>(all.text.size()), static_cast<unsigned>(run.begin),
                      static_cast<int>(run.end - run.begin));
  const bool right_to_left = (all.level[run.begin] & 1) != 0;
  hb_buffer_set_direction(buffer.get(), right_to_left ? HB_DIRECTION_RTL : HB_DIRECTION_LTR);
  hb_buffer_set_script(buffer.get(), all.script[run.begin]);
  hb_buffer_set_language(buffer.get(), hb_language_from_string("und", -1));
  hb_shape(shaper, buffer.get(), nullptr, 0);
  unsigned count = 0;
  const hb_glyph_info_t* info = hb_buffer_get_glyph_infos(buffer.get(), &count);
  const hb_glyph_position_t* at = hb_buffer_get_glyph_positions(buffer.get(), &count);
  for (unsigned i = 0; i < count; ++i) {
    run.glyphs.push_back({font, info[i].codepoint, run.width_px + at[i].x_offset / kGlyphUnit,
                          -at[i].y_offset / kGlyphUnit});
    const double advance_px = at[i].x_advance / kGlyphUnit;
    const std::size_t character = info[i].cluster - run.begin;
    if (character < run.advance_px.size()) run.advance_px[character] += advance_px;
    run.width_px += advance_px;
  }
}

std::vector<Run> ShapeRuns(FontStore& fonts, const Characters& all, const LayoutOptions& options) {
  std::vector<Run> runs;
  for (std::size_t i = 0; i < all.text.size();) {
    Run run{i, i + 1, {}, {}, 0};
    while (run.end < all.text.size() && all.font[run.end] == all.font[i] &&
           all.script[run.end] == all.script[i] && all.level[run.end] == all.level[i]) {
      ++run.end;
    }
    i = run.end;
    Shape(fonts, all, options, run);
    runs.push_back(std::move(run));
  }
  return runs;
}

/// Rule L2: from the highest level down to the lowest odd one, whatever is at that level or above
/// is turned round.
void ReorderRuns(const Characters& all, std::vector<Run>& runs) {
  FriBidiLevel highest = 0;
  for (const Run& run : runs) highest = std::max(highest, all.level[run.begin]);
  for (FriBidiLevel level = highest; level > 0; --level) {
    const auto lower = [&](const Run& run) { return all.level[run.begin] < level; };
    for (auto begin = runs.begin(); begin != runs.end();) {
      begin = std::find_if_not(begin, runs.end(), lower);
      const auto end = std::find_if(begin, runs.end(), lower);
      // `lower` reads run.begin alone, so that turned runs keep their levels.
      std::reverse(begin, end);
      begin = end;
    }
  }
}

TextLine SetLine(FontStore& fonts, const Characters& all, const LayoutOptions& options) {
  std::vector<Run> runs = ShapeRuns(fonts, all, options);
  ReorderRuns(all, runs);
  TextLine line;
  line.right_to_left = all.right_to_left;
  for (const Run& run : runs) {
    for (PlacedGlyph glyph : run.glyphs) {
      glyph.x_px += line.width_px;
      line.glyphs.push_back(glyph);
    }
    line.width_px += run.width_px;
  }
  return line;
}

/// Where the line that begins at `begin` ends.
std::size_t LineEnd(const Characters& all, const std::vector<double>& advance_px, std::size_t begin,
                    double room_px) {
  double width_px = 0, inked_px = 0;
  std::size_t good = begin, last = begin;  // where it may end; where it must
  for (std::size_t i = begin; i < all.text.size(); ++i) {
    if (i > begin && all.begins[i]) {
      last = i;
      if (MayBreakBetween(all.text[i - 1], all.text[i])) good = i;
    }
    width_px += advance_px[i];
    if (all.text[i] != ' ') inked_px = width_px;  // blanks may hang over
    if (inked_px > room_px && last > begin) return good > begin ? good : last;
  }
  return all.text.size();
}

/// The last line that there is room for, with an ellipsis for the rest.
Characters CutLine(const Characters& all, const std::vector<double>& advance_px, std::size_t begin,
                   const FontCatalogue& catalogue, const LayoutOptions& options) {
  double room_px = options.max_width_px - options.size_px;  // an ellipsis is up to one em wide
  std::size_t end = begin;
  for (; end < all.text.size() && room_px - advance_px[end] >= 0; ++end) room_px -= advance_px[end];
  while (end > begin && end < all.text.size() && !all.begins[end]) --end;
  while (end > begin && all.text[end - 1] == ' ') --end;
  Characters line = all.Slice(begin, end);
  line.text += U'…';
  line.level.push_back(all.right_to_left ? 1 : 0);
  line.font.push_back(catalogue.FontFor(U"…", false).value_or(kNoFont));
  line.script.push_back(HB_SCRIPT_COMMON);
  line.begins.push_back(true);
  return line;
}

class Setter {
 public:
  Setter(FontStore& fonts, const LayoutOptions& options) : fonts_(fonts), options_(options) {}

  void Add(const Characters& all, bool more_follows) {
    std::vector<double> advance_px;
    for (const Run& run : ShapeRuns(fonts_, all, options_)) {
      advance_px.insert(advance_px.end(), run.advance_px.begin(), run.advance_px.end());
    }
    for (std::size_t begin = 0; begin < all.text.size() && !layout.cut;) {
      const std::size_t end = LineEnd(all, advance_px, begin, options_.max_width_px);
      const bool is_last = static_cast<int>(layout.lines.size()) + 1 >= options_.max_lines;
      if (is_last && (end < all.text.size() || more_follows)) {
        layout.cut = true;
        Put(CutLine(all, advance_px, begin, fonts_.catalogue(), options_));
        return;
      }
      std::size_t inked = end;
      while (inked > begin && all.text[inked - 1] == ' ') --inked;
      if (inked > begin) Put(all.Slice(begin, inked));
      begin = end;
      while (begin < all.text.size() && all.text[begin] == ' ') ++begin;
    }
  }

  TextLayout layout;

 private:
  void Put(const Characters& line) {
    layout.lines.push_back(SetLine(fonts_, line, options_));
    layout.width_px = std::max(layout.width_px, layout.lines.back().width_px);
  }

  FontStore& fonts_;
  const LayoutOptions& options_;
};

}  // namespace

TextLayout LayOut(FontStore& fonts, std::string_view utf8, const LayoutOptions& options) {
  Setter setter(fonts, options);
  const std::u32string text = DrawableText(utf8);
  const auto has_ink = [&text](std::size_t from) {
    return text.find_first_not_of(U" \n", from) != text.npos;
  };
  for (std::size_t begin = 0; begin < text.size() && !setter.layout.cut && has_ink(begin);) {
    const std::size_t end = std::min(text.find(U'\n', begin), text.size());
    const std::size_t inked = std::min(text.find_first_not_of(U' ', begin), end);
    if (inked < end) {
      setter.Add(Analyse(fonts.catalogue(), text.substr(inked, end - inked), setter.layout.missing),
                 has_ink(end));
    }
    begin = end + 1;
  }
  return std::move(setter.layout);
}

}  // namespace saccade
