#include "server/gl/gl_context.hpp"

#include <absl/strings/str_cat.h>

#include <string>

#include "server/gl/osmesa_context.hpp"

namespace saccade {

absl::StatusOr<GlBackend> ParseGlBackend(std::string_view name) {
  if (name == "osmesa") return GlBackend::kOsmesa;
  if (name == "egl") return GlBackend::kEgl;
  return absl::InvalidArgumentError(
      absl::StrCat("--gl ", std::string(name), ": unknown; give osmesa (software) or egl"));
}

absl::StatusOr<std::unique_ptr<GlContext>> GlContext::Create(GlBackend backend) {
  if (backend == GlBackend::kEgl) {
    return absl::UnimplementedError("--gl egl: not part of this build; use --gl osmesa");
  }
  return CreateOsmesaContext();
}

}  // namespace saccade
