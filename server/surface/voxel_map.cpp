#include "server/surface/voxel_map.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr float kVoxelScale = 32767.0f;
constexpr float kVoxelMostWeight = 200.0f * VoxelMap::kUnitWeight;
constexpr float kLeastLook = 0.25f, kMostLook = 2.0f;  // weight of one look
constexpr float kColorReach = 1.5f;                    // voxels from the surface
constexpr float kColorShare = 0.3f;                    // of a look like the others
constexpr int kGainStride = 4;                         // pixels of the view that are asked
constexpr std::size_t kGainFewest = 60;

struct CameraFrame {
  explicit CameraFrame(const FusedView& view)
      : turn(view.world_from_camera.RotationMatrix().transpose().cast<float>()),
        centre(view.world_from_camera.translation.cast<float>()) {}
  Eigen::Vector3f operator()(const Eigen::Vector3f& point) const { return turn * (point - centre); }
  Eigen::Matrix3f turn;  // camera from world
  Eigen::Vector3f centre;
};

VoxelMap::Key KeyOf(const Eigen::Vector3f& point, float size) {
  return {static_cast<std::int32_t>(std::floor(point.x() / size)),
          static_cast<std::int32_t>(std::floor(point.y() / size)),
          static_cast<std::int32_t>(std::floor(point.z() / size))};
}

float Luma(const std::array<std::uint8_t, 3>& bgr) {
  return 0.114f * bgr[0] + 0.587f * bgr[1] + 0.299f * bgr[2];
}

/// The colour of who was nearest, evened over those that were as near: a mean over all would blur.
void Paint(const cv::Vec3b& seen, float gain, float look, VoxelMap::Voxel& voxel) {
  const auto weight = static_cast<std::uint8_t>(60.0f * look * look + 1.0f);
  if (10 * weight < 7 * voxel.color_weight) return;
  const float share = 10 * weight > 15 * voxel.color_weight ? 1.0f : kColorShare;
  for (int c = 0; c < 3; ++c) {
    const float value = std::min(255.0f, static_cast<float>(seen[c]) * gain);
    const float before = voxel.color_bgr[c];
    voxel.color_bgr[c] = static_cast<std::uint8_t>(before + share * (value - before) + 0.5f);
  }
  voxel.color_weight = std::max(voxel.color_weight, weight);
}

}  // namespace

float VoxelMap::Truncation(float depth) const {
  return std::max(static_cast<float>(options_.truncation_voxels) * voxel_,
                  static_cast<float>(options_.truncation_share) * depth);
}

std::vector<VoxelMap::Key> VoxelMap::Grow(const FusedView& view) {
  const Eigen::Matrix3f turn = view.world_from_camera.RotationMatrix().cast<float>();
  const Eigen::Vector3f centre = view.world_from_camera.translation.cast<float>();
  const Pinhole& camera = view.depth.camera;
  const float size = kSide * voxel_;
  std::vector<Key> grown;
  Key last{INT32_MAX, 0, 0};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const float inverse = view.depth.inverse_depth.at<float>(y, x);
      if (inverse <= 0.0f) continue;
      const float depth = view.length_factor / inverse;
      const float truncation = Truncation(depth);
      const Eigen::Vector3f ray = turn * camera.Ray(static_cast<float>(x), static_cast<float>(y));
      for (float z = depth - truncation; z <= depth + truncation; z += 2.0f * voxel_) {
        const Key key = KeyOf(centre + z * ray, size);
        if (key == last) continue;
        last = key;
        if (full()) return grown;
        auto& block = blocks_[key];
        if (block) continue;
        block = std::make_unique<Block>();
        grown.push_back(key);
      }
    }
  }
  return grown;
}

bool VoxelMap::Sees(const FusedView& view, const Key& key) const {
  const float size = kSide * voxel_;
  const Eigen::Vector3f middle =
      size * (Eigen::Vector3f(static_cast<float>(key[0]), static_cast<float>(key[1]),
                              static_cast<float>(key[2])) +
              Eigen::Vector3f::Constant(0.5f));
  const Eigen::Vector3f there = CameraFrame(view)(middle);
  const float radius = 0.87f * size;
  if (there.z() < voxel_) return false;
  const Pinhole& camera = view.depth.camera;
  const float reach = 1.5f * radius * camera.focal_px / there.z();
  const float u = camera.focal_px * there.x() / there.z() + camera.cx;
  const float v = camera.focal_px * there.y() / there.z() + camera.cy;
  return u > -reach && v > -reach && u < static_cast<float>(camera.width) + reach &&
         v < static_cast<float>(camera.height) + reach;
}

std::vector<VoxelMap::Key> VoxelMap::Seen(const FusedView& view) const {
  std::vector<Key> seen;
  for (const auto& [key, block] : blocks_) {
    if (Sees(view, key)) seen.push_back(key);
  }
  std::sort(seen.begin(), seen.end());
  return seen;
}

void VoxelMap::Fuse(const FusedView& view, const Key& key) {
  Block& block = *blocks_.at(key);
  const CameraFrame frame(view);
  const Pinhole& camera = view.depth.camera;
  const auto width = static_cast<float>(camera.width), height = static_cast<float>(camera.height);
  const Eigen::Vector3f step = frame.turn.col(0) * voxel_;
  const float* inverse_depths = view.depth.inverse_depth.ptr<float>();
  for (int k = 0; k < kVoxels; k += kSide) {
    const int j = k / kSide % kSide, l = k / (kSide * kSide);
    // A voxel's value is that of its low corner.
    Eigen::Vector3f point = frame(voxel_ * Eigen::Vector3f(static_cast<float>(key[0] * kSide),
                                                           static_cast<float>(key[1] * kSide + j),
                                                           static_cast<float>(key[2] * kSide + l)));
    for (int i = 0; i < kSide; ++i, point += step) {
      const float z = point.z();
      if (z < voxel_) continue;
      const float scale = camera.focal_px / z;
      const float fu = scale * point.x() + camera.cx + 0.5f;
      const float fv = scale * point.y() + camera.cy + 0.5f;
      if (!(fu >= 0.0f && fv >= 0.0f && fu < width && fv < height)) continue;
      const int u = static_cast<int>(fu), v = static_cast<int>(fv);
      const float inverse = inverse_depths[v * camera.width + u];
      if (inverse <= 0.0f) continue;
      const float depth = view.length_factor / inverse;
      const float truncation = Truncation(depth);
      if (depth - z < -truncation) continue;
      const float off = (depth - z) / truncation;
      Voxel& voxel = block[k + i];
      const float look = std::clamp(view.distance / depth, kLeastLook, kMostLook);
      // Behind a surface less is known the deeper it is: thin things have another side.
      const float weight = kUnitWeight * look * (off < 0.0f ? std::max(0.1f, 1.0f + off) : 1.0f);
      const float before = voxel.weight;
      const float sum = before + weight;
      const float mean = (static_cast<float>(voxel.distance) * before +
                          kVoxelScale * std::min(1.0f, off) * weight) /
                         sum;
      voxel.distance = static_cast<std::int16_t>(mean + std::copysign(0.5f, mean));
      voxel.weight = static_cast<std::uint16_t>(std::min(sum, kVoxelMostWeight));
      if (std::abs(depth - z) > kColorReach * voxel_) continue;
      Paint(view.color.at<cv::Vec3b>(v, u), view.color_gain, look, voxel);
    }
  }
}

void VoxelMap::Clear(const Key& key) { blocks_.at(key)->fill(Voxel()); }

bool VoxelMap::DropIfEmpty(const Key& key) {
  const auto found = blocks_.find(key);
  if (found == blocks_.end()) return false;
  for (const Voxel& voxel : *found->second) {
    if (voxel.weight > 0 && std::abs(voxel.distance) < kVoxelScale) return false;
  }
  blocks_.erase(found);
  return true;
}

const VoxelMap::Voxel* VoxelMap::At(const Eigen::Vector3f& point) const {
  const Key corner = KeyOf(point + Eigen::Vector3f::Constant(0.5f * voxel_), voxel_);
  const auto split = [](int at) { return std::pair(at >> 3, at & 7); };
  const auto [bx, x] = split(corner[0]);
  const auto [by, y] = split(corner[1]);
  const auto [bz, z] = split(corner[2]);
  const Block* block = Find({bx, by, bz});
  return block == nullptr ? nullptr : &(*block)[(z * kSide + y) * kSide + x];
}

float VoxelMap::GainOf(const FusedView& view) const {
  std::vector<float> ratios;
  const Pinhole& camera = view.depth.camera;
  for (int y = 0; y < camera.height; y += kGainStride) {
    for (int x = 0; x < camera.width; x += kGainStride) {
      const float inverse = view.depth.inverse_depth.at<float>(y, x);
      if (inverse <= 0.0f) continue;
      const Eigen::Vector3f ray = camera.Ray(static_cast<float>(x), static_cast<float>(y));
      const Voxel* voxel =
          At((view.world_from_camera * (ray * (view.length_factor / inverse)).cast<double>().eval())
                 .cast<float>());
      if (voxel == nullptr || voxel->color_weight == 0) continue;
      const cv::Vec3b& seen = view.color.at<cv::Vec3b>(y, x);
      const float own = Luma({seen[0], seen[1], seen[2]});
      const float there = Luma(voxel->color_bgr);
      if (own < 20.0f || own > 235.0f || there < 20.0f || there > 235.0f) continue;
      ratios.push_back(there / own);
    }
  }
  if (ratios.size() < kGainFewest) return 1.0f;
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2),
                   ratios.end());
  return std::clamp(ratios[ratios.size() / 2], 0.5f, 2.0f);
}

}  // namespace saccade
