#pragma once

#include <map>
#include <memory>
#include <set>

#include "server/surface/surface_nets.hpp"
#include "server/surface/voxel_map.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

/// Depth maps of keyframes as one surface, in chunks.
///
/// What a voxel holds is what the views that are in now tell of it, in the order of their ids: a
/// view that has moved or gone leaves nothing behind, since its blocks are made anew from the
/// others. Work is done in small steps. Not for several threads.
class SurfaceFusion {
 public:
  using Chunks = SurfaceSnapshot::Chunks;

  /// `voxel`: side of one, in the map's unit.
  SurfaceFusion(float voxel, const SurfaceOptions& options)
      : options_(options), voxels_(voxel, options) {}

  /// A view that is new, or another than it was.
  void Set(std::int64_t id, FusedView view);
  void Remove(std::int64_t id);

  /// Some milliseconds of what is to be done; false: nothing is.
  bool Work();

  /// Chunks with a surface, and those that have lost theirs, so that others may hear of it.
  const Chunks& chunks() const { return chunks_; }
  std::uint64_t version() const { return version_; }  // of the newest chunk
  /// Versions go on from here: of a surface that takes another's place.
  void StartVersionsAt(std::uint64_t version) { version_ = version; }
  const VoxelMap& voxels() const { return voxels_; }
  std::size_t bytes() const;

 private:
  void Touch(const VoxelMap::Key& block);
  void Replay(const VoxelMap::Key& block);
  void Extract(const SurfaceChunk::Index& index);

  const SurfaceOptions options_;
  VoxelMap voxels_;
  std::map<std::int64_t, FusedView> views_;
  std::set<VoxelMap::Key> stale_;          // blocks to be made anew
  std::set<SurfaceChunk::Index> touched_;  // chunks to be extracted
  Chunks chunks_;
  std::uint64_t version_ = 0;
};

}  // namespace saccade
