#pragma once

#include <absl/strings/string_view.h>

#include <memory>
#include <string>

#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

/// Surfaces as the third part of a map's file (docs/design/maps.md). Chunks without triangles are
/// left out; versions and editions are the run's.
std::string EncodeSurface(const SurfaceSnapshot& surface);
/// Null: these bytes are no surface.
std::shared_ptr<const SurfaceSnapshot> DecodeSurface(absl::string_view bytes);

}  // namespace saccade
