#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace saccade {

/// A font file, and which characters it has.
struct FontFile {
  std::string path;
  int index = 0;  // in a collection
  bool bold = false;
  bool color = false;              // pictures (emoji), of one size
  std::shared_ptr<void> coverage;  // FcCharSet
};

/// Of letters: bold to be read from afar, over a picture; regular in a window.
enum class FontWeight { kBold, kRegular };

/// The fonts of this system, best first: sans serif of that weight, then whatever else is
/// installed. Immutable; any thread.
class FontCatalogue {
 public:
  /// What fontconfig knows, read once. Says on stderr, once, which named script has no font and
  /// which package would bring it.
  static const FontCatalogue& System(FontWeight weight = FontWeight::kBold);

  explicit FontCatalogue(std::vector<FontFile> fonts, FontWeight weight = FontWeight::kBold)
      : fonts_(std::move(fonts)), weight_(weight) {}

  FontWeight weight() const { return weight_; }

  const std::vector<FontFile>& fonts() const { return fonts_; }

  /// Index of the first font that has all of `cluster`, else of the first that has its beginning.
  /// Nothing where no font has even that.
  std::optional<std::size_t> FontFor(std::u32string_view cluster, bool emoji) const;

  /// A line for each script that people were promised and that no font has, with the remedy.
  std::vector<std::string> Missing() const;

 private:
  std::optional<std::size_t> FirstWith(std::u32string_view cluster, bool color) const;

  std::vector<FontFile> fonts_;
  FontWeight weight_;
};

}  // namespace saccade
