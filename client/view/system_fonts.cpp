#include "client/view/system_fonts.hpp"

#include <fontconfig/fontconfig.h>

#include <map>
#include <memory>

namespace saccade::view {
namespace {

struct Destroy {
  void operator()(FcPattern* pattern) const { FcPatternDestroy(pattern); }
  void operator()(FcCharSet* characters) const { FcCharSetDestroy(characters); }
  void operator()(FcFontSet* fonts) const { FcFontSetDestroy(fonts); }
};
using PatternPtr = std::unique_ptr<FcPattern, Destroy>;

std::optional<FontFile> Look(unsigned character) {
  const std::unique_ptr<FcCharSet, Destroy> wanted(FcCharSetCreate());
  FcCharSetAddChar(wanted.get(), character);
  const PatternPtr pattern(FcPatternCreate());
  FcPatternAddString(pattern.get(), FC_FAMILY, reinterpret_cast<const FcChar8*>("sans-serif"));
  FcPatternAddCharSet(pattern.get(), FC_CHARSET, wanted.get());
  FcPatternAddBool(pattern.get(), FC_OUTLINE, FcTrue);
  FcPatternAddBool(pattern.get(), FC_COLOR, FcFalse);
  FcConfigSubstitute(nullptr, pattern.get(), FcMatchPattern);
  FcDefaultSubstitute(pattern.get());
  FcResult result = FcResultMatch;
  const std::unique_ptr<FcFontSet, Destroy> fonts(
      FcFontSort(nullptr, pattern.get(), FcTrue, nullptr, &result));
  if (fonts == nullptr) return std::nullopt;
  for (int i = 0; i < fonts->nfont; ++i) {
    FcPattern* const font = fonts->fonts[i];
    FcCharSet* has = nullptr;
    FcBool colour = FcFalse;
    FcChar8* path = nullptr;
    FontFile file;
    FcPatternGetBool(font, FC_COLOR, 0, &colour);
    if (colour == FcTrue || FcPatternGetCharSet(font, FC_CHARSET, 0, &has) != FcResultMatch ||
        FcCharSetHasChar(has, character) != FcTrue ||
        FcPatternGetString(font, FC_FILE, 0, &path) != FcResultMatch) {
      continue;
    }
    FcPatternGetInteger(font, FC_INDEX, 0, &file.index);
    file.index &= 0xffff;  // above: a named instance
    file.path = reinterpret_cast<const char*>(path);
    return file;
  }
  return std::nullopt;
}

}  // namespace

std::optional<FontFile> FontWith(unsigned character) {
  static auto& known = *new std::map<unsigned, std::optional<FontFile>>;
  const auto [at, is_new] = known.try_emplace(character);
  if (is_new) at->second = Look(character);
  return at->second;
}

}  // namespace saccade::view
