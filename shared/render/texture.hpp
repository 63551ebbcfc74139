#pragma once

#include <cstdint>
#include <span>

#include "shared/render/gl_functions.hpp"

namespace saccade {

/// Layout of the bytes given to a Texture; each row is tightly packed.
enum class PixelLayout { kGrey8, kBgr8, kRgb8, kRgba8, kBgra8 };

/// A 2-D texture, trilinear with mip-maps, or bilinear without.
/// Created, used and destroyed while its context is current; `gl` must outlive it.
class Texture {
 public:
  struct Options {
    bool mipmaps = true;
    bool repeat = true;     // false: clamp to the edge
    float lod_bias = 0.0f;  // > 0: softer
  };
  /// `pixels` holds width * height pixels, first row first; that row has texture coordinate v = 0.
  Texture(const GlFunctions& gl, int width, int height, PixelLayout layout,
          std::span<const std::uint8_t> pixels, const Options& options);
  ~Texture();
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;

  /// Other pixels of the same size and layout. For a texture without mip-maps.
  void Replace(std::span<const std::uint8_t> pixels);
  void Bind(int unit) const;
  GLuint id() const { return id_; }

 private:
  const GlFunctions& gl_;
  const int width_, height_;
  const PixelLayout layout_;
  GLuint id_ = 0;
};

}  // namespace saccade
