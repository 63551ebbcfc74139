#pragma once

#include <map>
#include <memory>

#include "shared/scene/surface_chunk.hpp"

namespace saccade {

/// All chunks at one moment. Immutable once published; chunks are shared with those before.
struct SurfaceSnapshot {
  using Chunks = std::map<SurfaceChunk::Index, std::shared_ptr<const SurfaceChunk>>;

  std::uint64_t generation = 0;  // MapSnapshot::map_generation that it belongs to
  std::uint64_t edition = 0;     // another one: chunks of the one before mean nothing any more
  std::uint64_t version = 0;     // of the newest chunk; within an edition it never falls
  float voxel = 0.0f;            // how fine it is, in the map's unit
  Chunks chunks;                 // those that have lost their triangles, too
};

/// Where editions begin: at random, so that those of a server that ran before are other ones, and
/// below 2^52, so that JavaScript's numbers hold what is counted from it.
std::uint64_t FirstSurfaceEdition();

}  // namespace saccade
