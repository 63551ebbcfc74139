#pragma once

#include <hb.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "shared/text/font_catalogue.hpp"

// FreeType's own names, so that only font_store.cpp sees its macros.
struct FT_LibraryRec_;
struct FT_FaceRec_;

namespace saccade {

/// A glyph's picture. Its upper left pixel is at (left, -top) from the origin on the baseline.
struct GlyphPicture {
  cv::Mat pixels;  // CV_8UC1 coverage, or CV_8UC4 BGRA, premultiplied
  int left = 0, top = 0;
};

/// The catalogue's fonts, opened when they are first needed. FreeType is not thread safe: one store
/// for each thread.
class FontStore {
 public:
  explicit FontStore(const FontCatalogue& catalogue);
  ~FontStore();
  FontStore(const FontStore&) = delete;
  FontStore& operator=(const FontStore&) = delete;

  const FontCatalogue& catalogue() const { return catalogue_; }

  /// For shaping; its unit is 1/64 px. Null if the file cannot be read.
  hb_font_t* Shaper(std::size_t font, int size_px);

  /// `shift_px`: how far right of a whole pixel it begins, [0, 1). Empty if there is no picture.
  GlyphPicture Draw(std::size_t font, std::uint32_t glyph, int size_px, double shift_px);

 private:
  struct Face;
  Face* Open(std::size_t font);

  const FontCatalogue& catalogue_;
  FT_LibraryRec_* library_ = nullptr;
  std::vector<std::unique_ptr<Face>> faces_;
};

}  // namespace saccade
