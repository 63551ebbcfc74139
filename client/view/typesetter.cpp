#include "client/view/typesetter.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "client/view/theme.hpp"
#include "shared/text/characters.hpp"

namespace saccade::view {
namespace {

constexpr ImWchar kFirst = 0xe000, kLast = 0xf8ff;  // the private use area
constexpr ImWchar kReplacement = 0xfffd;
constexpr std::size_t kMostTexts = 2000;
constexpr int kMostLines = 200;
constexpr std::uint32_t kBlank = 1;  // of kNoFont: nothing but its advance; 0: a box

/// Of what is always there, each character stands for itself.
bool StandsAlone(char32_t c) { return c == U'\n' || (c >= 0x20 && c < 0x7f) || IsAlwaysThere(c); }

/// Written from the right, joined, or above and below one another.
bool IsSetTogether(char32_t c) {
  return (c >= 0x300 && c < 0x370) || (c >= 0x590 && c < 0x10a0) || (c >= 0x1700 && c < 0x1e00) ||
         (c >= 0x200b && c <= 0x200f) || (c >= 0xa800 && c < 0xac00) ||
         (c >= 0xfb1d && c < 0xfe10) || (c >= 0xfe70 && c < 0xff00) || c > 0xffff;
}

void Append(std::string& out, char32_t c) {
  if (c < 0x80) {
    out += static_cast<char>(c);
    return;
  }
  const int more = c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
  constexpr char32_t kLead[] = {0, 0xc0, 0xe0, 0xf0};
  out += static_cast<char>(kLead[more] | (c >> (6 * more)));
  for (int i = more - 1; i >= 0; --i) out += static_cast<char>(0x80 | ((c >> (6 * i)) & 0x3f));
}

/// Malformed bytes are U+FFFD.
template <typename Seen>
void EachCharacter(const std::string& utf8, const Seen& seen) {
  for (std::size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i]);
    const std::size_t size = lead < 0x80           ? 1
                             : (lead >> 5) == 6    ? 2
                             : (lead >> 4) == 14   ? 3
                             : (lead >> 3) == 0x1e ? 4
                                                   : 0;
    if (size == 0 || i + size > utf8.size()) {
      seen(static_cast<char32_t>(kReplacement));
      ++i;
      continue;
    }
    char32_t c = size == 1 ? lead : lead & (0x7fu >> size);
    for (std::size_t k = 1; k < size; ++k) {
      c = (c << 6) | (static_cast<unsigned char>(utf8[i + k]) & 0x3fu);
    }
    seen(c);
    i += size;
  }
}

GlyphPicture Box(int em_px) {
  const int height = std::max(cvRound(0.72 * em_px), 4), width = std::max(cvRound(0.5 * em_px), 3);
  GlyphPicture box{cv::Mat::zeros(height, width, CV_8UC1), std::max(cvRound(0.06 * em_px), 1),
                   height};
  cv::rectangle(box.pixels, {0, 0, width, height}, cv::Scalar(255));
  return box;
}

ImU32 ColourOf(const cv::Mat& pixels, int x, int y) {
  if (pixels.channels() == 1) return IM_COL32(255, 255, 255, pixels.at<std::uint8_t>(y, x));
  const auto& bgra = pixels.at<cv::Vec4b>(y, x);  // premultiplied
  const int alpha = std::max<int>(bgra[3], 1);
  const auto plain = [alpha](int value) { return std::min(value * 255 / alpha, 255); };
  return IM_COL32(plain(bgra[2]), plain(bgra[1]), plain(bgra[0]), bgra[3]);
}

}  // namespace

Typesetter& Types() {
  static auto& types = *new Typesetter;
  return types;
}

Typesetter::Typesetter() : fonts_(FontCatalogue::System(FontWeight::kRegular)), next_(kFirst) {}

bool Typesetter::IsSimple(const std::string& utf8) {
  bool simple = true;
  EachCharacter(utf8, [&simple](char32_t c) { simple = simple && !IsSetTogether(c); });
  return simple;
}

void Typesetter::SetSize(int em_px) {
  if (em_px == em_px_) return;
  em_px_ = em_px;
  kept_.clear();
  known_.clear();
  set_.clear();
  next_ = kFirst;
  stale_ = true;
  const auto characters = std::exchange(in_field_, {});  // a field goes on with what it has
  for (const auto& [character, in_field] : characters) {
    in_field_[character] = in_field;
    if (const auto glyph = Alone(character)) CharacterOf(*glyph, in_field);
  }
}

ImWchar Typesetter::CharacterOf(const Glyph& glyph, ImWchar wanted) {
  const auto found = known_.find({glyph, wanted});
  if (found != known_.end()) return found->second;
  const ImWchar character = wanted != 0 ? wanted : Free();
  if (character == kLast) return kReplacement;
  known_[{glyph, wanted}] = character;
  kept_.push_back({glyph, character, PictureOf(glyph)});
  stale_ = true;
  return character;
}

ImWchar Typesetter::Free() {
  while (next_ < kLast && from_field_.contains(next_)) ++next_;
  return next_ < kLast ? next_++ : kLast;
}

GlyphPicture Typesetter::PictureOf(const Glyph& glyph) {
  const auto& [font, index, down, advance] = glyph;
  if (font != kNoFont) return fonts_.Draw(font, index, em_px_, 0);
  return index == kBlank ? GlyphPicture{} : Box(em_px_);
}

std::optional<Typesetter::Glyph> Typesetter::Alone(char32_t character) {
  std::string text;
  Append(text, character);
  const TextLayout one = LayOut(fonts_, text, {em_px_, 1e9, 1});
  if (one.lines.empty() || one.lines[0].glyphs.empty()) return std::nullopt;
  const PlacedGlyph& glyph = one.lines[0].glyphs[0];
  return Glyph{glyph.font, glyph.glyph, cvRound(glyph.y_px), cvRound(one.width_px)};
}

std::string Typesetter::Line(const TextLine& line, double right_px) {
  std::string out;
  const double left_px = line.right_to_left ? std::max(right_px - line.width_px, 0.0) : 0.0;
  int at = 0;
  if (left_px >= 1) {
    at = cvRound(left_px);
    Append(out, CharacterOf({kNoFont, kBlank, 0, at}));
  }
  for (std::size_t i = 0; i < line.glyphs.size(); ++i) {
    const PlacedGlyph& glyph = line.glyphs[i];
    const bool last = i + 1 == line.glyphs.size();
    const int next = cvRound(left_px + (last ? line.width_px : line.glyphs[i + 1].x_px));
    Append(out, CharacterOf({glyph.font, glyph.glyph, cvRound(glyph.y_px), next - at}));
    at = next;
  }
  return out;
}

std::string Typesetter::Set(const std::string& utf8, float width_px) {
  bool alone = true;
  EachCharacter(utf8, [&alone](char32_t c) { alone = alone && StandsAlone(c); });
  if (alone) return utf8;
  if (set_.size() > kMostTexts) set_.clear();
  const auto [at, is_new] = set_.try_emplace({utf8, static_cast<int>(width_px)});
  if (is_new) {
    const double room = width_px > 0 ? std::floor(width_px) : 1e9;
    const TextLayout text = LayOut(fonts_, utf8, {em_px_, room, kMostLines});
    for (const TextLine& line : text.lines) {
      if (!at->second.set.empty()) at->second.set += '\n';
      at->second.set += Line(line, std::min(text.width_px, room));
    }
    at->second.since = generation_ + (stale_ ? 1 : 0);
  }
  return at->second.since > generation_ ? " " : at->second.set;
}

ImWchar Typesetter::ToField(char32_t character) {
  if (StandsAlone(character)) return static_cast<ImWchar>(character);
  const auto found = in_field_.find(character);
  if (found != in_field_.end()) return found->second;
  if (character >= kFirst && character <= kLast) return kReplacement;
  const std::optional<Glyph> glyph = Alone(character);
  if (character <= 0xffff) {
    const auto same = static_cast<ImWchar>(character);
    return in_field_[character] = glyph ? CharacterOf(*glyph, same) : same;
  }
  if (!glyph) return kReplacement;
  const ImWchar its_own = Free();
  if (its_own == kLast) return kReplacement;
  from_field_[its_own] = character;
  return in_field_[character] = CharacterOf(*glyph, its_own);
}

std::string Typesetter::ToField(const std::string& utf8) {
  std::string out;
  EachCharacter(utf8, [&](char32_t c) { Append(out, ToField(c)); });
  return out;
}

std::string Typesetter::FromField(const std::string& field) const {
  std::string out;
  EachCharacter(field, [&](char32_t c) {
    const auto found = c <= 0xffff ? from_field_.find(static_cast<ImWchar>(c)) : from_field_.end();
    Append(out, found == from_field_.end() ? c : found->second);
  });
  return out;
}

void Typesetter::Reserve(ImFontAtlas& atlas) {
  for (Kept& each : kept_) {
    const cv::Mat& pixels = each.picture.pixels;
    each.reserved = -1;
    // A pixel on each side stays empty: what is beside it in the atlas is not its own.
    if (!pixels.empty())
      each.reserved = atlas.AddCustomRectRegular(pixels.cols + 2, pixels.rows + 2);
  }
  stale_ = false;
  ++generation_;
}

void Typesetter::Draw(ImFontAtlas& atlas, const std::vector<ImFont*>& fonts) {
  unsigned char* bytes = nullptr;
  int width = 0, height = 0;
  atlas.GetTexDataAsRGBA32(&bytes, &width, &height);
  auto* texels = reinterpret_cast<ImU32*>(bytes);
  for (const Kept& each : kept_) {
    const auto& [font, index, down, advance] = each.glyph;
    const cv::Mat& pixels = each.picture.pixels;
    const ImFontAtlasCustomRect* room =
        each.reserved < 0 ? nullptr : atlas.GetCustomRectByIndex(each.reserved);
    const bool drawn = room != nullptr && room->IsPacked();
    for (int y = 0; drawn && y < pixels.rows; ++y) {
      for (int x = 0; x < pixels.cols; ++x) {
        texels[(room->Y + 1 + y) * width + room->X + 1 + x] = ColourOf(pixels, x, y);
      }
    }
    for (ImFont* to : fonts) {
      const float left = static_cast<float>(each.picture.left);
      const float top = std::round(to->Ascent) + static_cast<float>(down - each.picture.top);
      const auto u = [&](int x) {
        return static_cast<float>(room->X + x) / static_cast<float>(width);
      };
      const auto v = [&](int y) {
        return static_cast<float>(room->Y + y) / static_cast<float>(height);
      };
      if (drawn) {
        to->AddGlyph(nullptr, each.character, left, top, left + static_cast<float>(pixels.cols),
                     top + static_cast<float>(pixels.rows), u(1), v(1), u(1 + pixels.cols),
                     v(1 + pixels.rows), static_cast<float>(advance));
        to->Glyphs.back().Colored = pixels.channels() == 4 ? 1 : 0;
      } else {
        to->AddGlyph(nullptr, each.character, 0, 0, 0, 0, 0, 0, 0, 0, static_cast<float>(advance));
      }
    }
  }
  for (ImFont* to : fonts) to->BuildLookupTable();
}

}  // namespace saccade::view
