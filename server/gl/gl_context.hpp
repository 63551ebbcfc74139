#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <string_view>

namespace saccade {

/// How an off-screen OpenGL context is made (`--gl osmesa|egl`).
enum class GlBackend { kOsmesa, kEgl };

/// `osmesa` or `egl`; InvalidArgument names anything else.
absl::StatusOr<GlBackend> ParseGlBackend(std::string_view name);

/// An off-screen OpenGL 3.3 core context. It has no useful default framebuffer: draw into a
/// `Framebuffer` of shared/render.
///
/// A context is current on at most one thread at a time. Make it, use it and destroy it on the same
/// thread; any number of threads may each have their own.
class GlContext {
 public:
  using Procedure = void (*)();

  virtual ~GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Binds the context to the calling thread.
  virtual absl::Status MakeCurrent() = 0;
  /// Address of an OpenGL function by its full name ("glClear"); for a name that it does not know,
  /// null or (Mesa) a stub that does nothing. Pass it to GlFunctions::Load.
  virtual Procedure GetProcAddress(const char* name) const = 0;

  /// Makes a context and binds it to the calling thread.
  ///   Unimplemented  the backend is not part of this build
  ///   Internal       the driver refused
  static absl::StatusOr<std::unique_ptr<GlContext>> Create(GlBackend backend = GlBackend::kOsmesa);

 protected:
  GlContext() = default;
};

}  // namespace saccade
