#include "server/gl/osmesa_context.hpp"

// osmesa.h pulls in gl.h, whose prototypes are never called: every function comes by address.
#include <GL/osmesa.h>

#include <array>
#include <cstdint>
#include <cstdlib>

namespace saccade {
namespace {

class OsmesaContext final : public GlContext {
 public:
  OsmesaContext() {
    // The picture is drawn on the calling thread plus one rasteriser thread, unless the user says
    // otherwise: tracker and encoder need the other cores (measured 2026-11-22).
    ::setenv("LP_NUM_THREADS", "1", /*overwrite=*/0);
    const std::array<int, 13> attributes = {OSMESA_FORMAT,
                                            OSMESA_BGRA,
                                            OSMESA_DEPTH_BITS,
                                            24,
                                            OSMESA_PROFILE,
                                            OSMESA_CORE_PROFILE,
                                            OSMESA_CONTEXT_MAJOR_VERSION,
                                            3,
                                            OSMESA_CONTEXT_MINOR_VERSION,
                                            3,
                                            0,
                                            0,
                                            0};
    context_ = OSMesaCreateContextAttribs(attributes.data(), nullptr);
  }
  ~OsmesaContext() override {
    if (context_ != nullptr) OSMesaDestroyContext(context_);
  }

  bool valid() const { return context_ != nullptr; }

  absl::Status MakeCurrent() override {
    if (OSMesaMakeCurrent(context_, pixels_.data(), GL_UNSIGNED_BYTE, kSide, kSide) != GL_TRUE) {
      return absl::InternalError("OSMesa would not make its context current");
    }
    return absl::OkStatus();
  }

  Procedure GetProcAddress(const char* name) const override { return OSMesaGetProcAddress(name); }

 private:
  static constexpr int kSide = 16;  // OSMesa insists on a default framebuffer, however small
  OSMesaContext context_ = nullptr;
  std::array<std::uint8_t, kSide * kSide * 4> pixels_{};
};

}  // namespace

absl::StatusOr<std::unique_ptr<GlContext>> CreateOsmesaContext() {
  auto context = std::make_unique<OsmesaContext>();
  if (!context->valid()) {
    return absl::InternalError("OSMesa made no OpenGL 3.3 core context; is libosmesa6 installed?");
  }
  if (const absl::Status current = context->MakeCurrent(); !current.ok()) return current;
  return std::unique_ptr<GlContext>(std::move(context));
}

}  // namespace saccade
