#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <span>

#include "shared/render/gl_functions.hpp"

namespace saccade {

/// An off-screen target: RGBA colour and 24-bit depth.
/// Created, used and destroyed while its context is current; `gl` must outlive it.
class Framebuffer {
 public:
  static absl::StatusOr<std::unique_ptr<Framebuffer>> Create(const GlFunctions& gl, int width,
                                                             int height);
  ~Framebuffer();
  Framebuffer(const Framebuffer&) = delete;
  Framebuffer& operator=(const Framebuffer&) = delete;

  /// Draws go here from now on; sets the viewport to the whole target.
  void Bind() const;
  /// Copies the colours, 4 bytes B G R A a pixel, width * height * 4 in all. The first row is
  /// OpenGL's lowest (window y = 0): draw with image v increasing along window y and it is the top.
  absl::Status ReadBgra(std::span<std::uint8_t> pixels) const;
  /// Copies the depth buffer, in [0, 1], width * height floats, rows as in ReadBgra.
  absl::Status ReadDepth(std::span<float> depths) const;

  int width() const { return width_; }
  int height() const { return height_; }

 private:
  Framebuffer(const GlFunctions& gl, int width, int height)
      : gl_(gl), width_(width), height_(height) {}

  const GlFunctions& gl_;
  int width_ = 0, height_ = 0;
  GLuint id_ = 0, color_ = 0, depth_ = 0;
};

}  // namespace saccade
