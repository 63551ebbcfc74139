#include "shared/text/font_store.hpp"

#include <ft2build.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include FT_FREETYPE_H
#include FT_OUTLINE_H

namespace saccade {
namespace {

constexpr FT_Pos kUnit = 64;           // of a pixel
constexpr FT_Pos kEmboldenShare = 24;  // of the size: no thin type, where a font has no bold

GlyphPicture PictureOf(const FT_GlyphSlot slot, double scale) {
  const FT_Bitmap& bitmap = slot->bitmap;
  GlyphPicture picture{{}, slot->bitmap_left, slot->bitmap_top};
  if (bitmap.width == 0 || bitmap.rows == 0 || bitmap.pitch <= 0) return picture;
  const int type = bitmap.pixel_mode == FT_PIXEL_MODE_BGRA   ? CV_8UC4
                   : bitmap.pixel_mode == FT_PIXEL_MODE_GRAY ? CV_8UC1
                                                             : -1;
  if (type < 0) return picture;
  const cv::Mat pixels(static_cast<int>(bitmap.rows), static_cast<int>(bitmap.width), type,
                       bitmap.buffer, static_cast<std::size_t>(bitmap.pitch));
  if (scale == 1.0) {
    picture.pixels = pixels.clone();
    return picture;
  }
  const cv::Size size(std::max(1, cvRound(scale * pixels.cols)),
                      std::max(1, cvRound(scale * pixels.rows)));
  cv::resize(pixels, picture.pixels, size, 0, 0, cv::INTER_AREA);
  picture.left = cvRound(scale * picture.left);
  picture.top = cvRound(scale * picture.top);
  return picture;
}

}  // namespace

struct FontStore::Face {
  ~Face() {
    hb_font_destroy(shaper);
    if (face != nullptr) FT_Done_Face(face);
  }
  FT_Face face = nullptr;
  hb_font_t* shaper = hb_font_get_empty();
  int size_px = 0;
  double picture_scale = 1.0;  // of colour fonts: they have one size
};

FontStore::FontStore(const FontCatalogue& catalogue)
    : catalogue_(catalogue), faces_(catalogue.fonts().size()) {
  if (FT_Init_FreeType(&library_) != 0) library_ = nullptr;
}

FontStore::~FontStore() {
  faces_.clear();
  if (library_ != nullptr) FT_Done_FreeType(library_);
}

FontStore::Face* FontStore::Open(std::size_t font) {
  if (font >= faces_.size()) return nullptr;
  if (!faces_[font]) {
    faces_[font] = std::make_unique<Face>();
    const FontFile& file = catalogue_.fonts()[font];
    Face& face = *faces_[font];
    if (library_ != nullptr &&
        FT_New_Face(library_, file.path.c_str(), file.index, &face.face) == 0) {
      hb_blob_t* blob = hb_blob_create_from_file_or_fail(file.path.c_str());
      hb_face_t* shapes = hb_face_create(blob, static_cast<unsigned>(file.index));
      face.shaper = hb_font_create(shapes);
      hb_face_destroy(shapes);
      hb_blob_destroy(blob);
    } else {
      face.face = nullptr;
    }
  }
  return faces_[font]->face != nullptr ? faces_[font].get() : nullptr;
}

hb_font_t* FontStore::Shaper(std::size_t font, int size_px) {
  Face* face = Open(font);
  if (face == nullptr) return nullptr;
  hb_font_set_scale(face->shaper, size_px * static_cast<int>(kUnit),
                    size_px * static_cast<int>(kUnit));
  return face->shaper;
}

GlyphPicture FontStore::Draw(std::size_t font, std::uint32_t glyph, int size_px, double shift_px) {
  Face* face = Open(font);
  if (face == nullptr) return {};
  const FontFile& file = catalogue_.fonts()[font];
  if (face->size_px != size_px) {
    if (FT_IS_SCALABLE(face->face)) {
      if (FT_Set_Pixel_Sizes(face->face, 0, static_cast<FT_UInt>(size_px)) != 0) return {};
      face->picture_scale = 1.0;
    } else {
      if (FT_Select_Size(face->face, 0) != 0) return {};
      face->picture_scale =
          static_cast<double>(size_px) / std::max<int>(1, face->face->size->metrics.y_ppem);
    }
    face->size_px = size_px;
  }
  const bool outline = FT_IS_SCALABLE(face->face) && !file.color;
  const FT_Int32 flags = outline ? FT_LOAD_NO_BITMAP | FT_LOAD_TARGET_LIGHT : FT_LOAD_COLOR;
  if (FT_Load_Glyph(face->face, glyph, flags) != 0) return {};
  const FT_GlyphSlot slot = face->face->glyph;
  if (slot->format == FT_GLYPH_FORMAT_OUTLINE) {
    if (!file.bold && catalogue_.weight() == FontWeight::kBold) {
      FT_Outline_Embolden(&slot->outline, size_px * kUnit / kEmboldenShare);
    }
    FT_Outline_Translate(&slot->outline, std::lround(shift_px * kUnit), 0);
  }
  if (FT_Render_Glyph(slot, FT_RENDER_MODE_NORMAL) != 0) return {};
  return PictureOf(slot, face->picture_scale);
}

}  // namespace saccade
