#pragma once

#include "server/surface/voxel_map.hpp"
#include "shared/scene/surface_chunk.hpp"

namespace saccade {

/// Blocks along each side of a chunk.
inline constexpr int kChunkBlocks = 4;

/// The chunk that holds a block.
SurfaceChunk::Index ChunkOf(const VoxelMap::Key& block);

/// The surface inside one chunk, only where voxels on both sides of it are known: one corner in
/// each cell that it passes, a quad across each edge that it cuts (naive surface nets: Gibson,
/// "Constrained elastic surface nets", MICCAI 1998). Neighbouring chunks fit without cracks. Small
/// pieces that float alone are left out. `least_weight`: of a voxel, in looks.
SurfaceChunk ExtractChunk(const VoxelMap& voxels, const SurfaceChunk::Index& index,
                          double least_weight);

}  // namespace saccade
