#include "server/surface/surface_nets.hpp"

#include <cmath>
#include <numeric>

namespace saccade {
namespace {

constexpr int kNetSide = kChunkBlocks * VoxelMap::kSide;  // voxels of a chunk
constexpr int kNetGrid = kNetSide + 2;                    // from -1 to kNetSide
constexpr float kNetVoxel = 64.0f;                        // steps: a quarter of a millimetre
constexpr int kSmallPiece = 24;                           // triangles
constexpr int kNobody = -1;

using Voxel = VoxelMap::Voxel;

/// The chunk's voxels and one more on each side.
class Grid {
 public:
  Grid(const VoxelMap& map, const SurfaceChunk::Index& index)
      : voxels_(kNetGrid * kNetGrid * kNetGrid) {
    const int first[3] = {index[0] * kNetSide - 1, index[1] * kNetSide - 1,
                          index[2] * kNetSide - 1};
    for (int bz = index[2] * kChunkBlocks - 1; bz <= (index[2] + 1) * kChunkBlocks; ++bz) {
      for (int by = index[1] * kChunkBlocks - 1; by <= (index[1] + 1) * kChunkBlocks; ++by) {
        for (int bx = index[0] * kChunkBlocks - 1; bx <= (index[0] + 1) * kChunkBlocks; ++bx) {
          if (const VoxelMap::Block* block = map.Find({bx, by, bz}))
            Copy(*block, bx, by, bz, first);
        }
      }
    }
  }
  static int Offset(int x, int y, int z) { return (z * kNetGrid + y) * kNetGrid + x; }
  const Voxel& operator[](int offset) const { return voxels_[offset]; }
  bool empty() const { return empty_; }

 private:
  void Copy(const VoxelMap::Block& block, int bx, int by, int bz, const int (&first)[3]) {
    constexpr int kSide = VoxelMap::kSide;
    for (int k = 0; k < VoxelMap::kVoxels; ++k) {
      const int x = bx * kSide + k % kSide - first[0];
      const int y = by * kSide + k / kSide % kSide - first[1];
      const int z = bz * kSide + k / (kSide * kSide) - first[2];
      if (x < 0 || y < 0 || z < 0 || x >= kNetGrid || y >= kNetGrid || z >= kNetGrid) continue;
      voxels_[Offset(x, y, z)] = block[k];
      empty_ = false;
    }
  }
  std::vector<Voxel> voxels_;
  bool empty_ = true;
};

class Net {
 public:
  Net(const Grid& grid, int least_weight, SurfaceChunk& chunk)
      : grid_(grid),
        least_(least_weight),
        chunk_(chunk),
        corner_of_(kNetGrid * kNetGrid * kNetGrid, kNobody) {}

  void MakeCorners() {
    for (int z = 0; z < kNetGrid - 1; ++z) {
      for (int y = 0; y < kNetGrid - 1; ++y) {
        for (int x = 0; x < kNetGrid - 1; ++x) MakeCorner(x, y, z);
      }
    }
  }

  void MakeQuads() {
    // An edge belongs to the chunk that its low end is in; the grid begins one before it.
    for (int z = 1; z <= kNetSide; ++z) {
      for (int y = 1; y <= kNetSide; ++y) {
        for (int x = 1; x <= kNetSide; ++x) {
          const int at = Grid::Offset(x, y, z);
          if (grid_[at].weight < least_) continue;
          for (int axis = 0; axis < 3; ++axis) MakeQuad(at, axis);
        }
      }
    }
  }

 private:
  static constexpr int kStride[3] = {1, kNetGrid, kNetGrid* kNetGrid};

  void MakeCorner(int x, int y, int z) {
    const int at = Grid::Offset(x, y, z);
    float values[8];
    int above = 0;
    for (int c = 0; c < 8; ++c) {
      const Voxel& voxel = grid_[at + (c & 1) + (c >> 1 & 1) * kStride[1] + (c >> 2) * kStride[2]];
      if (voxel.weight < least_) return;
      values[c] = voxel.distance;
      above += values[c] > 0.0f ? 1 : 0;
    }
    if (above == 0 || above == 8) return;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float cuts = 0.0f;
    for (int c = 0; c < 8; ++c) {
      for (int axis = 0; axis < 3; ++axis) {
        const int other = c | 1 << axis;
        if (other == c || (values[c] > 0.0f) == (values[other] > 0.0f)) continue;
        Eigen::Vector3f cut(static_cast<float>(c & 1), static_cast<float>(c >> 1 & 1),
                            static_cast<float>(c >> 2));
        cut[axis] = values[c] / (values[c] - values[other]);
        sum += cut;
        cuts += 1.0f;
      }
    }
    if (chunk_.positions.size() >= 65'535) return;
    const Eigen::Vector3f place =
        (Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)) +
         sum / cuts) *
        kNetVoxel;
    corner_of_[at] = static_cast<int>(chunk_.positions.size());
    chunk_.positions.push_back({static_cast<std::uint16_t>(std::lround(place.x())),
                                static_cast<std::uint16_t>(std::lround(place.y())),
                                static_cast<std::uint16_t>(std::lround(place.z()))});
    chunk_.colors_rgb.push_back(ColorOf(at));
  }

  std::array<std::uint8_t, 3> ColorOf(int at) const {
    float sum[3] = {}, weights = 0.0f;
    for (int c = 0; c < 8; ++c) {
      const Voxel& voxel = grid_[at + (c & 1) + (c >> 1 & 1) * kStride[1] + (c >> 2) * kStride[2]];
      const float weight = voxel.color_weight;
      for (int i = 0; i < 3; ++i) sum[i] += weight * voxel.color_bgr[2 - i];
      weights += weight;
    }
    if (weights <= 0.0f) return {128, 128, 128};
    return {static_cast<std::uint8_t>(sum[0] / weights),
            static_cast<std::uint8_t>(sum[1] / weights),
            static_cast<std::uint8_t>(sum[2] / weights)};
  }

  void MakeQuad(int at, int axis) {
    const Voxel &low = grid_[at], &high = grid_[at + kStride[axis]];
    if (high.weight < least_ || (low.distance > 0) == (high.distance > 0)) return;
    const int u = kStride[(axis + 1) % 3], v = kStride[(axis + 2) % 3];
    const int corners[4] = {corner_of_[at - u - v], corner_of_[at - v], corner_of_[at],
                            corner_of_[at - u]};
    for (const int corner : corners) {
      if (corner == kNobody) return;
    }
    // Round the axis; seen from the side where the distance is above 0.
    const auto add = [&](int a, int b, int c) {
      chunk_.triangles.push_back({static_cast<std::uint16_t>(corners[a]),
                                  static_cast<std::uint16_t>(corners[b]),
                                  static_cast<std::uint16_t>(corners[c])});
    };
    if (high.distance > 0) {
      add(0, 1, 2);
      add(0, 2, 3);
    } else {
      add(0, 2, 1);
      add(0, 3, 2);
    }
  }

  const Grid& grid_;
  const int least_;
  SurfaceChunk& chunk_;
  std::vector<int> corner_of_;  // of the cell whose low voxel it is
};

/// Leaves out pieces that float alone, and corners that nothing uses.
void Tidy(SurfaceChunk& chunk) {
  std::vector<int> parent(chunk.positions.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int at) {
    while (parent[at] != at) at = parent[at] = parent[parent[at]];
    return at;
  };
  for (const SurfaceChunk::Triangle& t : chunk.triangles) {
    parent[root(t[0])] = root(t[1]);
    parent[root(t[1])] = root(t[2]);
  }
  std::vector<int> triangles(parent.size(), 0);
  for (const SurfaceChunk::Triangle& t : chunk.triangles) ++triangles[root(t[0])];
  for (std::size_t i = 0; i < parent.size(); ++i) {  // what reaches the border may go on
    for (const std::uint16_t at : chunk.positions[i]) {
      if (at < 2.0f * kNetVoxel || at > (kNetGrid - 2.0f) * kNetVoxel) {
        triangles[root(static_cast<int>(i))] += kSmallPiece;
      }
    }
  }
  std::erase_if(chunk.triangles, [&](const SurfaceChunk::Triangle& t) {
    return triangles[root(t[0])] < kSmallPiece;
  });
  std::vector<int> place(parent.size(), kNobody);
  std::size_t used = 0;
  for (SurfaceChunk::Triangle& t : chunk.triangles) {
    for (std::uint16_t& corner : t) {
      if (place[corner] == kNobody) place[corner] = static_cast<int>(used++);
      corner = static_cast<std::uint16_t>(place[corner]);
    }
  }
  auto positions = chunk.positions;
  auto colors = chunk.colors_rgb;
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] == kNobody) continue;
    positions[place[i]] = chunk.positions[i];
    colors[place[i]] = chunk.colors_rgb[i];
  }
  positions.resize(used);
  colors.resize(used);
  positions.shrink_to_fit();
  colors.shrink_to_fit();
  chunk.positions = std::move(positions);
  chunk.colors_rgb = std::move(colors);
}

}  // namespace

SurfaceChunk::Index ChunkOf(const VoxelMap::Key& block) {
  static_assert(kChunkBlocks == 4);
  return {block[0] >> 2, block[1] >> 2, block[2] >> 2};
}

SurfaceChunk ExtractChunk(const VoxelMap& voxels, const SurfaceChunk::Index& index,
                          double least_weight) {
  SurfaceChunk chunk;
  chunk.index = index;
  chunk.origin_in_world =
      voxels.voxel() *
      (kNetSide * Eigen::Vector3f(static_cast<float>(index[0]), static_cast<float>(index[1]),
                                  static_cast<float>(index[2])) -
       Eigen::Vector3f::Ones());
  chunk.step_m = voxels.voxel() / kNetVoxel;
  chunk.span = static_cast<std::uint16_t>(kNetGrid * kNetVoxel);
  const Grid grid(voxels, index);
  if (grid.empty()) return chunk;
  Net net(grid, std::max(1, static_cast<int>(std::lround(least_weight * VoxelMap::kUnitWeight))),
          chunk);
  net.MakeCorners();
  net.MakeQuads();
  Tidy(chunk);
  return chunk;
}

}  // namespace saccade
