#include "server/sim/ray_caster.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace saccade {
namespace {

constexpr std::uint32_t kLeafSize = 4;

}  // namespace

RayCaster::RayCaster(const RoomScene& scene) {
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const SurfacePatch& patch = scene.patches[p];
    for (int j = 0; j < patch.rows; ++j) {
      for (int i = 0; i < patch.columns; ++i) {
        const int stride = patch.columns + 1;
        const std::array<int, 4> corner = {j * stride + i, j * stride + i + 1, (j + 1) * stride + i,
                                           (j + 1) * stride + i + 1};
        const auto st = [&](int v) {
          return Eigen::Vector2f(static_cast<float>(v % stride) / static_cast<float>(patch.columns),
                                 static_cast<float>(v / stride) / static_cast<float>(patch.rows));
        };
        const auto add = [&](int a, int b, int c) {
          const auto& position = patch.positions;
          const auto at = [&](int v) { return position[static_cast<std::size_t>(v)]; };
          triangles_.push_back({at(a), at(b) - at(a), at(c) - at(a), st(a), st(b) - st(a),
                                st(c) - st(a), static_cast<int>(p), patch.casts_shadow});
        };
        add(corner[0], corner[2], corner[1]);
        add(corner[1], corner[2], corner[3]);
      }
    }
  }
  nodes_.reserve(triangles_.size() * 2);
  nodes_.emplace_back();
  Build(0, 0, static_cast<std::uint32_t>(triangles_.size()));
}

void RayCaster::Build(std::uint32_t node, std::uint32_t first, std::uint32_t count) {
  Eigen::Array3f low = Eigen::Array3f::Constant(1e9f), high = -low;
  Eigen::Array3f centre_low = low, centre_high = high;
  const auto centre = [](const Triangle& t) { return (t.a + (t.edge1 + t.edge2) / 3.0f).array(); };
  for (std::uint32_t i = first; i < first + count; ++i) {
    const Triangle& t = triangles_[i];
    for (const Eigen::Vector3f& p :
         {t.a, Eigen::Vector3f(t.a + t.edge1), Eigen::Vector3f(t.a + t.edge2)}) {
      low = low.min(p.array());
      high = high.max(p.array());
    }
    const Eigen::Array3f c = centre(t);
    centre_low = centre_low.min(c);
    centre_high = centre_high.max(c);
  }
  nodes_[node].low = low - 1e-4f;
  nodes_[node].high = high + 1e-4f;
  if (count <= kLeafSize) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  int axis = 0;
  (centre_high - centre_low).maxCoeff(&axis);
  const std::uint32_t half = count / 2;
  const auto begin = triangles_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](const Triangle& a, const Triangle& b) {
    return centre(a)[axis] < centre(b)[axis];
  });
  const auto left = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  nodes_.emplace_back();
  nodes_[node].first = left;
  Build(left, first, half);
  Build(left + 1, first + half, count - half);
}

template <bool kAny>
std::optional<RayHit> RayCaster::Trace(const Eigen::Vector3f& origin,
                                       const Eigen::Vector3f& direction, float max_distance) const {
  const Eigen::Array3f inverse = direction.array().inverse();
  RayHit best;
  best.distance = max_distance;
  std::array<std::uint32_t, 64> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  const auto enter = [&](const Node& node) {
    const Eigen::Array3f a = (node.low - origin.array()) * inverse;
    const Eigen::Array3f b = (node.high - origin.array()) * inverse;
    const float near = a.min(b).maxCoeff(), far = a.max(b).minCoeff();
    return near <= far && far >= 0 && near < best.distance ? near : 1e10f;
  };
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (node.count == 0) {
      const float left = enter(nodes_[node.first]), right = enter(nodes_[node.first + 1]);
      const bool left_first = left < right;
      const std::uint32_t near = node.first + (left_first ? 0 : 1);
      const std::uint32_t far = node.first + (left_first ? 1 : 0);
      if (std::max(left, right) < 1e9f) stack[depth++] = far;
      if (std::min(left, right) < 1e9f) stack[depth++] = near;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Triangle& t = triangles_[i];
      if (kAny && !t.casts_shadow) continue;
      const Eigen::Vector3f p = direction.cross(t.edge2);
      const float determinant = t.edge1.dot(p);
      if (std::abs(determinant) < 1e-12f) continue;
      const float scale = 1.0f / determinant;
      const Eigen::Vector3f from_a = origin - t.a;
      const float u = from_a.dot(p) * scale;
      if (u < 0 || u > 1) continue;
      const Eigen::Vector3f q = from_a.cross(t.edge1);
      const float v = direction.dot(q) * scale;
      if (v < 0 || u + v > 1) continue;
      const float distance = t.edge2.dot(q) * scale;
      if (distance <= 1e-5f || distance >= best.distance) continue;
      best = {distance, t.patch, (t.st_a + u * t.st1 + v * t.st2).x(),
              (t.st_a + u * t.st1 + v * t.st2).y(), determinant > 0};
      if (kAny) return best;
    }
  }
  if (best.patch < 0) return std::nullopt;
  return best;
}

std::optional<RayHit> RayCaster::Closest(const Eigen::Vector3f& origin,
                                         const Eigen::Vector3f& direction,
                                         float max_distance) const {
  return Trace<false>(origin, direction, max_distance);
}

bool RayCaster::Blocked(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                        float max_distance) const {
  return Trace<true>(origin, direction, max_distance).has_value();
}

}  // namespace saccade
