#include "shared/render/texture.hpp"

namespace saccade {
namespace {

struct GlLayout {
  GLint internal;
  GLenum format;
};

GlLayout LayoutOf(PixelLayout layout) {
  switch (layout) {
    case PixelLayout::kGrey8:
      return {GL_R8, GL_RED};
    case PixelLayout::kBgr8:
      return {GL_RGBA8, GL_BGR};
    case PixelLayout::kRgb8:
      return {GL_RGBA8, GL_RGB};
    case PixelLayout::kBgra8:
      return {GL_RGBA8, GL_BGRA};
    case PixelLayout::kRgba8:
      break;
  }
  return {GL_RGBA8, GL_RGBA};
}

}  // namespace

Texture::Texture(const GlFunctions& gl, int width, int height, PixelLayout layout,
                 std::span<const std::uint8_t> pixels, const Options& options)
    : gl_(gl), width_(width), height_(height), layout_(layout) {
  const GlLayout gl_layout = LayoutOf(layout);
  gl_.GenTextures(1, &id_);
  gl_.BindTexture(GL_TEXTURE_2D, id_);
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl_.TexImage2D(GL_TEXTURE_2D, 0, gl_layout.internal, width, height, 0, gl_layout.format,
                 GL_UNSIGNED_BYTE, pixels.data());
  const GLint wrap = options.repeat ? GL_REPEAT : GL_CLAMP_TO_EDGE;
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, wrap);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, wrap);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER,
                    options.mipmaps ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR);
  if (options.lod_bias != 0.0f) {
    gl_.TexParameterf(GL_TEXTURE_2D, GL_TEXTURE_LOD_BIAS, options.lod_bias);
  }
  if (options.mipmaps) gl_.GenerateMipmap(GL_TEXTURE_2D);
}

Texture::~Texture() { gl_.DeleteTextures(1, &id_); }

void Texture::Replace(std::span<const std::uint8_t> pixels) {
  gl_.BindTexture(GL_TEXTURE_2D, id_);
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl_.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, LayoutOf(layout_).format,
                    GL_UNSIGNED_BYTE, pixels.data());
}

void Texture::Bind(int unit) const {
  gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  gl_.BindTexture(GL_TEXTURE_2D, id_);
}

}  // namespace saccade
