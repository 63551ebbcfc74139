#pragma once

#include <absl/container/flat_hash_map.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/surface/depth_map.hpp"
#include "server/surface/surface_options.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A keyframe's depth as it is fused: where it is now, how long its unit is now.
struct FusedView {
  DepthMap depth;
  cv::Mat color;               // CV_8UC3 BGR, of the depth's size
  float length_factor = 1.0f;  // depths are multiplied by it
  float color_gain = 1.0f;     // evens exposures
  float distance = 1.0f;       // typical, to what is in view: looks from there weigh 1
  Rigid3 world_from_camera;
};

/// A truncated signed distance to the nearest surface, above 0 where it was seen from, in blocks of
/// voxels near surfaces only: Curless and Levoy, "A volumetric method for building complex models
/// from range images", SIGGRAPH 1996; Niessner et al., "Real-time 3D reconstruction at scale using
/// voxel hashing", TOG 32(6), 2013.
///
/// Lengths in the map's unit. Not for several threads.
class VoxelMap {
 public:
  static constexpr int kSide = 8;  // voxels of a block
  static constexpr int kVoxels = kSide * kSide * kSide;
  static constexpr int kUnitWeight = 16;

  struct Voxel {
    std::int16_t distance = 0;  // 32767: the truncation
    std::uint16_t weight = 0;   // kUnitWeight: one look from the typical distance
    std::array<std::uint8_t, 3> color_bgr{};
    std::uint8_t color_weight = 0;  // of the nearest look
  };
  using Key = std::array<std::int32_t, 3>;
  using Block = std::array<Voxel, kVoxels>;  // x fastest

  VoxelMap(float voxel, const SurfaceOptions& options) : voxel_(voxel), options_(options) {}

  float voxel() const { return voxel_; }
  std::size_t size() const { return blocks_.size(); }
  std::size_t bytes() const { return blocks_.size() * (sizeof(Block) + 64); }
  bool full() const { return blocks_.size() >= options_.max_blocks; }

  /// Makes blocks where this view shows a surface; those that are new. None where it is full.
  std::vector<Key> Grow(const FusedView& view);
  /// Blocks that it may tell of: in its picture, and not behind all that it shows.
  std::vector<Key> Seen(const FusedView& view) const;
  bool Sees(const FusedView& view, const Key& key) const;
  /// Adds what it tells of one block, which must be there.
  void Fuse(const FusedView& view, const Key& key);
  /// As if nobody had told anything of it.
  void Clear(const Key& key);
  /// Drops a block in which there is no surface.
  bool DropIfEmpty(const Key& key);
  bool Has(const Key& key) const { return blocks_.contains(key); }

  /// Null where there is none.
  const Block* Find(const Key& key) const {
    const auto found = blocks_.find(key);
    return found == blocks_.end() ? nullptr : found->second.get();
  }
  /// By what this view's colours are to be multiplied to look like those that are there; 1 where
  /// too little of it is.
  float GainOf(const FusedView& view) const;

 private:
  float Truncation(float depth) const;
  const Voxel* At(const Eigen::Vector3f& point) const;

  const float voxel_;
  const SurfaceOptions options_;
  absl::flat_hash_map<Key, std::unique_ptr<Block>> blocks_;
};

}  // namespace saccade
