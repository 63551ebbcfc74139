#pragma once

#include <absl/status/statusor.h>

#include "saccade/v1/surface.pb.h"
#include "shared/scene/surface_chunk.hpp"

/// Pieces of surface to and from messages (docs/design/surfaces.md).
namespace saccade::wire {

/// Corners may come in another order.
v1::SurfaceChunk ToProto(const SurfaceChunk& chunk);

/// InvalidArgument: more corners or triangles than a chunk can have, a code that ends early or
/// holds something else, a triangle of a corner that is not there, a place that is not finite.
absl::StatusOr<SurfaceChunk> FromProto(const v1::SurfaceChunk& message);

}  // namespace saccade::wire
