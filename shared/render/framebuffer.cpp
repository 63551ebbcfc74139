#include "shared/render/framebuffer.hpp"

#include <absl/strings/str_cat.h>

namespace saccade {

absl::StatusOr<std::unique_ptr<Framebuffer>> Framebuffer::Create(const GlFunctions& gl, int width,
                                                                 int height) {
  auto made = std::unique_ptr<Framebuffer>(new Framebuffer(gl, width, height));
  gl.GenFramebuffers(1, &made->id_);
  gl.GenRenderbuffers(1, &made->color_);
  gl.GenRenderbuffers(1, &made->depth_);
  gl.BindFramebuffer(GL_FRAMEBUFFER, made->id_);
  gl.BindRenderbuffer(GL_RENDERBUFFER, made->color_);
  gl.RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, made->color_);
  gl.BindRenderbuffer(GL_RENDERBUFFER, made->depth_);
  gl.RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, width, height);
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, made->depth_);
  const GLenum status = gl.CheckFramebufferStatus(GL_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE) {
    return absl::InternalError(absl::StrCat("OpenGL refuses a ", width, "x", height,
                                            " framebuffer (0x", absl::Hex(status), ")"));
  }
  return made;
}

Framebuffer::~Framebuffer() {
  gl_.DeleteFramebuffers(1, &id_);
  gl_.DeleteRenderbuffers(1, &color_);
  gl_.DeleteRenderbuffers(1, &depth_);
}

void Framebuffer::Bind() const {
  gl_.BindFramebuffer(GL_FRAMEBUFFER, id_);
  gl_.Viewport(0, 0, width_, height_);
}

absl::Status Framebuffer::ReadBgra(std::span<std::uint8_t> pixels) const {
  const std::size_t needed =
      static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 4;
  if (pixels.size() < needed) {
    return absl::InvalidArgumentError(
        absl::StrCat("ReadBgra: ", pixels.size(), " bytes given, ", needed, " needed"));
  }
  gl_.BindFramebuffer(GL_FRAMEBUFFER, id_);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_.ReadPixels(0, 0, width_, height_, GL_BGRA, GL_UNSIGNED_BYTE, pixels.data());
  return CheckGl(gl_, "ReadBgra");
}

absl::Status Framebuffer::ReadDepth(std::span<float> depths) const {
  const std::size_t needed = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  if (depths.size() < needed) {
    return absl::InvalidArgumentError(
        absl::StrCat("ReadDepth: ", depths.size(), " floats given, ", needed, " needed"));
  }
  gl_.BindFramebuffer(GL_FRAMEBUFFER, id_);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_.ReadPixels(0, 0, width_, height_, GL_DEPTH_COMPONENT, GL_FLOAT, depths.data());
  return CheckGl(gl_, "ReadDepth");
}

}  // namespace saccade
