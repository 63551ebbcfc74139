#include "shared/text/characters.hpp"

#include <hb.h>

#include <algorithm>
#include <array>
#include <utility>

namespace saccade {
namespace {

constexpr std::size_t kMaxCharacters = 1200;
constexpr std::size_t kMaxMarks = 30;
constexpr std::size_t kMaxLineFeeds = 31;  // a check list
constexpr std::size_t kMaxJoined = 12;  // code points of an emoji sequence; Unicode's have up to 10
constexpr char32_t kReplacement = 0xfffd, kJoiner = 0x200d, kEmojiSelector = 0xfe0f;

using Range = std::pair<char32_t, char32_t>;

template <std::size_t N>
bool Among(char32_t c, const std::array<Range, N>& ranges) {
  return std::any_of(ranges.begin(), ranges.end(),
                     [c](const Range& range) { return c >= range.first && c <= range.second; });
}

/// Below U+1F000: shown in colour without being asked (Emoji_Presentation of Unicode 14).
constexpr auto kColored = std::to_array<Range>(
    {{0x231a, 0x231b}, {0x23e9, 0x23ec}, {0x23f0, 0x23f0}, {0x23f3, 0x23f3}, {0x25fd, 0x25fe},
     {0x2614, 0x2615}, {0x2648, 0x2653}, {0x267f, 0x267f}, {0x2693, 0x2693}, {0x26a1, 0x26a1},
     {0x26aa, 0x26ab}, {0x26bd, 0x26be}, {0x26c4, 0x26c5}, {0x26ce, 0x26ce}, {0x26d4, 0x26d4},
     {0x26ea, 0x26ea}, {0x26f2, 0x26f3}, {0x26f5, 0x26f5}, {0x26fa, 0x26fa}, {0x26fd, 0x26fd},
     {0x2705, 0x2705}, {0x270a, 0x270b}, {0x2728, 0x2728}, {0x274c, 0x274c}, {0x274e, 0x274e},
     {0x2753, 0x2755}, {0x2757, 0x2757}, {0x2795, 0x2797}, {0x27b0, 0x27b0}, {0x27bf, 0x27bf},
     {0x2b1b, 0x2b1c}, {0x2b50, 0x2b50}, {0x2b55, 0x2b55}});

constexpr auto kIdeographs = std::to_array<Range>({{0x2e80, 0x9fff},
                                                   {0xac00, 0xd7a3},
                                                   {0xf900, 0xfaff},
                                                   {0xff01, 0xff60},
                                                   {0x1f000, 0x1faff},
                                                   {0x20000, 0x3ffff}});
constexpr std::u32string_view kOpening = U"([{（［｛「『【〈《〔“‘¿¡";
constexpr std::u32string_view kClosing =
    U")]}）］｝」』】〉》〕”’、。，．：；！？!?,.:;%°…ー々っゃゅょァィゥェォッャュョ";

hb_unicode_general_category_t Category(char32_t c) {
  return hb_unicode_general_category(hb_unicode_funcs_get_default(), c);
}

bool IsMark(char32_t c) {
  const hb_unicode_general_category_t category = Category(c);
  return category == HB_UNICODE_GENERAL_CATEGORY_NON_SPACING_MARK ||
         category == HB_UNICODE_GENERAL_CATEGORY_ENCLOSING_MARK ||
         category == HB_UNICODE_GENERAL_CATEGORY_SPACING_MARK;
}

bool IsRegional(char32_t c) { return c >= 0x1f1e6 && c <= 0x1f1ff; }
bool IsTone(char32_t c) { return c >= 0x1f3fb && c <= 0x1f3ff; }
bool IsPictograph(char32_t c) {
  return c >= 0x1f000 || (c >= 0x2190 && c <= 0x2bff) || c == 0xa9 || c == 0xae;
}
/// Second and third parts of a Hangul syllable.
bool IsJamoTail(char32_t c) { return (c >= 0x1160 && c <= 0x11ff) || (c >= 0xd7b0 && c <= 0xd7fb); }

bool IsDropped(char32_t c) {
  return (c >= 0x202a && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069) || c == 0xfeff || c == '\r' ||
         (c >= 0xfff9 && c <= 0xfffb);
}

/// The next code point; a malformed one is U+FFFD and as long as its well-formed beginning.
char32_t Next(std::string_view& utf8) {
  const auto byte = [&utf8](std::size_t i) { return static_cast<unsigned char>(utf8[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return utf8.remove_prefix(1), first;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4) return utf8.remove_prefix(1), kReplacement;
  char32_t c = first & (0xff >> (length + 1));
  std::size_t read = 1;
  for (; read < length && read < utf8.size() && (byte(read) & 0xc0) == 0x80; ++read) {
    c = c << 6 | (byte(read) & 0x3fu);
  }
  const bool whole = read == length;
  utf8.remove_prefix(read);
  const bool too_small = (length == 3 && c < 0x800) || (length == 4 && c < 0x10000);
  if (!whole || too_small || (c >= 0xd800 && c <= 0xdfff) || c > 0x10ffff) return kReplacement;
  return c;
}

}  // namespace

bool IsIgnorable(char32_t c) {
  return (c >= 0x200b && c <= 0x200f) || (c >= 0x2060 && c <= 0x2064) || c == 0xad || c == 0x34f ||
         (c >= 0xfe00 && c <= 0xfe0f) || (c >= 0xe0000 && c <= 0xe0fff) || c == 0x61c ||
         (c >= 0x180b && c <= 0x180e);
}

std::u32string DrawableText(std::string_view utf8) {
  std::u32string text;
  std::size_t marks = 0, line_feeds = 0;
  while (!utf8.empty()) {
    char32_t c = Next(utf8);
    if (IsDropped(c)) continue;
    if (c == 0x2028 || c == 0x2029) c = '\n';
    if (c == '\n' && ++line_feeds > kMaxLineFeeds) c = ' ';
    if (c != '\n' && Category(c) == HB_UNICODE_GENERAL_CATEGORY_CONTROL) c = ' ';
    marks = IsMark(c) || IsIgnorable(c) ? marks + 1 : 0;
    if (marks > kMaxMarks) continue;
    if (text.size() == kMaxCharacters) {
      text.back() = U'…';
      break;
    }
    text += c;
  }
  return text;
}

std::vector<Cluster> SplitClusters(std::u32string_view text) {
  std::vector<Cluster> clusters;
  std::size_t i = 0;
  while (i < text.size()) {
    Cluster cluster{i, i + 1, false};
    const char32_t base = text[i];
    bool colored = base >= 0x1f000 || Among(base, kColored);
    std::size_t& end = cluster.end;
    if (IsRegional(base) && end < text.size() && IsRegional(text[end])) ++end;
    for (; end < text.size() && base != '\n'; ++end) {
      const char32_t c = text[end];
      const bool joined =
          text[end - 1] == kJoiner && IsPictograph(base) && IsPictograph(c) && end - i < kMaxJoined;
      if (joined || c == kEmojiSelector) colored = true;
      if (c == 0xfe0e) colored = false;
      if (!joined && !IsMark(c) && !IsTone(c) && !IsJamoTail(c) && !(IsIgnorable(c) && c != 0x200b))
        break;
    }
    cluster.emoji = colored;
    clusters.push_back(cluster);
    i = end;
  }
  return clusters;
}

bool MayBreakBetween(char32_t before, char32_t after) {
  if (after == ' ' || after == 0xa0 || before == 0xa0) return false;  // blanks stay at the end
  if (before == ' ' || before == 0x200b || before == 0x3000) return true;
  if (kClosing.find(after) != kClosing.npos || kOpening.find(before) != kOpening.npos) return false;
  if (before == '-' || before == '/' || (before >= 0x2010 && before <= 0x2014)) return true;
  return Among(before, kIdeographs) || Among(after, kIdeographs);
}

}  // namespace saccade
