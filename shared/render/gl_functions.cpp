#include "shared/render/gl_functions.hpp"

#include <absl/strings/str_cat.h>

namespace saccade {

absl::StatusOr<GlFunctions> GlFunctions::Load(const Loader& get_proc_address) {
  GlFunctions gl;
#define SACCADE_GL_LOAD(type, name)                                         \
  gl.name = reinterpret_cast<type>(get_proc_address("gl" #name));           \
  if (gl.name == nullptr) {                                                 \
    return absl::FailedPreconditionError("OpenGL has no function gl" #name  \
                                         "; a 3.3 core context is needed"); \
  }
  SACCADE_GL_FUNCTIONS(SACCADE_GL_LOAD)
#undef SACCADE_GL_LOAD
  return gl;
}

absl::Status CheckGl(const GlFunctions& gl, const char* where) {
  const GLenum error = gl.GetError();
  if (error == GL_NO_ERROR) return absl::OkStatus();
  while (gl.GetError() != GL_NO_ERROR) {
  }
  return absl::InternalError(absl::StrCat(where, ": OpenGL error 0x", absl::Hex(error)));
}

}  // namespace saccade
