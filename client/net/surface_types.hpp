#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "shared/scene/surface_chunk.hpp"

namespace saccade::net {

/// How new the place's surfaces are on the server.
struct SurfaceNews {
  std::uint64_t edition = 0, version = 0;
};

/// Some of them, newer than what was asked from.
struct SurfacePiece {
  std::uint64_t edition = 0;  // another one: what was had before means nothing; 0: none are made
  std::uint64_t version = 0;  // with these, all up to this one
  std::vector<std::shared_ptr<const SurfaceChunk>> chunks;
  bool more = false;
};

}  // namespace saccade::net
