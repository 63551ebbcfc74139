#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "server/gl/gl_context.hpp"

namespace saccade {

/// A software context (Mesa's llvmpipe through OSMesa), current on the calling thread.
absl::StatusOr<std::unique_ptr<GlContext>> CreateOsmesaContext();

}  // namespace saccade
