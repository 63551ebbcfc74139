#include "shared/text/font_catalogue.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <fontconfig/fontconfig.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <tuple>

#include "shared/io/log.hpp"
#include "shared/text/characters.hpp"

namespace saccade {
namespace {

// Debian's fonts-dejavu-core, fonts-wqy-microhei and fonts-noto-color-emoji.
constexpr std::array<const char*, 3> kPreferred = {"DejaVu Sans", "WenQuanYi Micro Hei",
                                                   "Noto Color Emoji"};

struct Promise {
  const char* script;
  std::u32string_view letters;
  const char* package;
};
constexpr std::array<Promise, 5> kPromises = {
    {{"Latin letters (German, Polish)", U"aßüłż", "fonts-dejavu-core"},
     {"Hebrew", U"שלם", "fonts-dejavu-core"},
     {"Arabic", U"عربي", "fonts-dejavu-core"},
     {"Chinese", U"检查油", "fonts-wqy-microhei"},
     {"emoji", U"😀🔧", "fonts-noto-color-emoji"}}};

int Int(FcPattern* pattern, const char* name, int otherwise) {
  int value = 0;
  return FcPatternGetInteger(pattern, name, 0, &value) == FcResultMatch ? value : otherwise;
}
bool Bool(FcPattern* pattern, const char* name) {
  FcBool value = FcFalse;
  return FcPatternGetBool(pattern, name, 0, &value) == FcResultMatch && value == FcTrue;
}
std::string String(FcPattern* pattern, const char* name) {
  FcChar8* value = nullptr;
  if (FcPatternGetString(pattern, name, 0, &value) != FcResultMatch) return "";
  return reinterpret_cast<const char*>(value);
}

struct Candidate {
  FontFile font;
  std::tuple<std::size_t, bool, bool, bool, int, std::string, int> order;
};

std::optional<Candidate> ReadPattern(FcPattern* pattern, FontWeight weight) {
  FontFile font;
  font.path = String(pattern, FC_FILE);
  font.index = Int(pattern, FC_INDEX, 0);
  font.bold = Int(pattern, FC_WEIGHT, FC_WEIGHT_REGULAR) >= FC_WEIGHT_DEMIBOLD;
  font.color = Bool(pattern, FC_COLOR);
  FcCharSet* coverage = nullptr;
  if (font.path.empty() || FcPatternGetCharSet(pattern, FC_CHARSET, 0, &coverage) != FcResultMatch)
    return std::nullopt;
  // Instances of variable fonts have high indices: their files are listed as themselves, too.
  if (font.index > 0xffff || (!font.color && !Bool(pattern, FC_SCALABLE))) return std::nullopt;
  font.coverage = std::shared_ptr<void>(
      FcCharSetCopy(coverage), [](void* set) { FcCharSetDestroy(static_cast<FcCharSet*>(set)); });
  const std::string family = String(pattern, FC_FAMILY);
  const std::size_t rank = static_cast<std::size_t>(
      std::find(kPreferred.begin(), kPreferred.end(), family) - kPreferred.begin());
  const bool slanted = Int(pattern, FC_SLANT, FC_SLANT_ROMAN) != FC_SLANT_ROMAN;
  const bool narrow = Int(pattern, FC_WIDTH, FC_WIDTH_NORMAL) != FC_WIDTH_NORMAL;
  const bool serif = !absl::StrContains(family, "Sans") && rank == kPreferred.size();
  const int weighs = Int(pattern, FC_WEIGHT, FC_WEIGHT_REGULAR);
  const int off = weight == FontWeight::kBold ? !font.bold : std::abs(weighs - FC_WEIGHT_REGULAR);
  auto order = std::tuple(rank, slanted, serif, narrow, off, font.path, font.index);
  return Candidate{std::move(font), std::move(order)};
}

std::vector<FontFile> ListFonts(FontWeight weight) {
  std::vector<FontFile> fonts;
  FcConfig* config = FcInitLoadConfigAndFonts();
  if (config == nullptr) return fonts;
  FcPattern* any = FcPatternCreate();
  FcObjectSet* wanted =
      FcObjectSetBuild(FC_FILE, FC_INDEX, FC_FAMILY, FC_WEIGHT, FC_SLANT, FC_WIDTH, FC_COLOR,
                       FC_SCALABLE, FC_CHARSET, static_cast<char*>(nullptr));
  FcFontSet* found = FcFontList(config, any, wanted);
  std::vector<Candidate> candidates;
  for (int i = 0; found != nullptr && i < found->nfont; ++i) {
    if (auto candidate = ReadPattern(found->fonts[i], weight))
      candidates.push_back(*std::move(candidate));
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.order < b.order; });
  for (Candidate& candidate : candidates) fonts.push_back(std::move(candidate.font));
  if (found != nullptr) FcFontSetDestroy(found);
  FcObjectSetDestroy(wanted);
  FcPatternDestroy(any);
  FcConfigDestroy(config);
  return fonts;
}

bool Has(const FontFile& font, char32_t c) {
  return FcCharSetHasChar(static_cast<const FcCharSet*>(font.coverage.get()), c) == FcTrue;
}

}  // namespace

const FontCatalogue& FontCatalogue::System(FontWeight weight) {
  const auto read = [](FontWeight wanted) {
    FontCatalogue found(ListFonts(wanted), wanted);
    for (const std::string& line : found.Missing()) {
      Log(line);
    }
    return found;
  };
  if (weight == FontWeight::kRegular) {
    static const FontCatalogue regular = read(FontWeight::kRegular);
    return regular;
  }
  static const FontCatalogue bold = read(FontWeight::kBold);
  return bold;
}

std::optional<std::size_t> FontCatalogue::FirstWith(std::u32string_view cluster, bool color) const {
  for (std::size_t i = 0; i < fonts_.size(); ++i) {
    const FontFile& font = fonts_[i];
    if (font.color == color && std::all_of(cluster.begin(), cluster.end(), [&font](char32_t c) {
          return IsIgnorable(c) || Has(font, c);
        })) {
      return i;
    }
  }
  return std::nullopt;
}

std::optional<std::size_t> FontCatalogue::FontFor(std::u32string_view cluster, bool emoji) const {
  if (cluster.empty()) return std::nullopt;
  for (const std::u32string_view part : {cluster, cluster.substr(0, 1)}) {
    for (const bool color : {emoji, !emoji}) {
      if (const std::optional<std::size_t> font = FirstWith(part, color)) return font;
    }
  }
  return std::nullopt;
}

std::vector<std::string> FontCatalogue::Missing() const {
  std::vector<std::string> lines;
  for (const Promise& promise : kPromises) {
    const bool there = std::all_of(
        promise.letters.begin(), promise.letters.end(),
        [this](char32_t c) { return FontFor(std::u32string_view(&c, 1), c > 0xffff).has_value(); });
    if (there) continue;
    lines.push_back(absl::StrCat("no font for ", promise.script,
                                 ": such text is drawn as boxes; install Debian's ",
                                 promise.package, " and start again"));
  }
  return lines;
}

}  // namespace saccade
