#include "server/surface/surface_fusion.hpp"

namespace saccade {
namespace {

constexpr int kReplayedAtOnce = 32;  // blocks

}  // namespace

void SurfaceFusion::Touch(const VoxelMap::Key& block) {
  touched_.insert(ChunkOf(block));
  // A chunk looks one voxel into its neighbours.
  for (int k = 0; k < 27; ++k) {
    touched_.insert(
        ChunkOf({block[0] + k % 3 - 1, block[1] + k / 3 % 3 - 1, block[2] + k / 9 - 1}));
  }
}

void SurfaceFusion::Set(std::int64_t id, FusedView view) {
  const auto before = views_.find(id);
  const bool known = before != views_.end();
  if (known) {
    for (const VoxelMap::Key& key : voxels_.Seen(before->second)) stale_.insert(key);
  } else {
    view.color_gain = voxels_.GainOf(view);
  }
  if (known) view.color_gain = before->second.color_gain;
  for (const VoxelMap::Key& key : voxels_.Grow(view)) stale_.insert(key);
  for (const VoxelMap::Key& key : voxels_.Seen(view)) {
    if (known) {
      stale_.insert(key);
    } else if (!stale_.contains(key)) {
      voxels_.Fuse(view, key);
      Touch(key);
    }
  }
  views_.insert_or_assign(id, std::move(view));
}

void SurfaceFusion::Remove(std::int64_t id) {
  const auto gone = views_.find(id);
  if (gone == views_.end()) return;
  for (const VoxelMap::Key& key : voxels_.Seen(gone->second)) stale_.insert(key);
  views_.erase(gone);
}

void SurfaceFusion::Replay(const VoxelMap::Key& block) {
  if (!voxels_.Has(block)) return;
  voxels_.Clear(block);
  for (const auto& [id, view] : views_) {
    if (voxels_.Sees(view, block)) voxels_.Fuse(view, block);
  }
  voxels_.DropIfEmpty(block);
  Touch(block);
}

void SurfaceFusion::Extract(const SurfaceChunk::Index& index) {
  SurfaceChunk chunk = ExtractChunk(voxels_, index, options_.least_weight);
  const auto before = chunks_.find(index);
  if (before == chunks_.end() && chunk.triangles.empty()) return;
  if (before != chunks_.end() && before->second->positions == chunk.positions &&
      before->second->colors_rgb == chunk.colors_rgb) {
    return;
  }
  chunk.version = ++version_;
  chunks_[index] = std::make_shared<const SurfaceChunk>(std::move(chunk));
}

bool SurfaceFusion::Work() {
  if (!stale_.empty()) {
    for (int k = 0; k < kReplayedAtOnce && !stale_.empty(); ++k) {
      Replay(*stale_.begin());
      stale_.erase(stale_.begin());
    }
    return true;
  }
  if (touched_.empty()) return false;
  Extract(*touched_.begin());
  touched_.erase(touched_.begin());
  return true;
}

std::size_t SurfaceFusion::bytes() const {
  std::size_t sum = voxels_.bytes();
  for (const auto& [id, view] : views_) {
    sum += view.depth.inverse_depth.total() * view.depth.inverse_depth.elemSize();
  }
  for (const auto& [index, chunk] : chunks_) {
    sum += chunk->positions.size() * 9 + chunk->triangles.size() * 6 + 200;
  }
  return sum;
}

}  // namespace saccade
