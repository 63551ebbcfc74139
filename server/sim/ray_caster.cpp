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
  Bounds bounds, centres;
  for (std::uint32_t i = first; i < first + count; ++i) {
    bounds.Add(BoundsOf(triangles_[i]));
    centres.Add(BoundsOf(triangles_[i]).Centre());
  }
  nodes_[node].low = bounds.low - 1e-4f;
  nodes_[node].high = bounds.high + 1e-4f;
  const Split split = count > kLeafSize ? BestSplit(first, count, centres) : Split{};
  if (split.axis < 0) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  const auto begin = triangles_.begin() + first;
  const auto middle = std::partition(begin, begin + count, [&](const Triangle& t) {
    return BoundsOf(t).Centre()[split.axis] < split.position;
  });
  const auto half = static_cast<std::uint32_t>(middle - begin);
  const auto left = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  nodes_.emplace_back();
  nodes_[node].first = left;
  Build(left, first, half);
  Build(left + 1, first + half, count - half);
}

RayCaster::Bounds RayCaster::BoundsOf(const Triangle& t) {
  Bounds bounds;
  bounds.Add(t.a.array());
  bounds.Add((t.a + t.edge1).array());
  bounds.Add((t.a + t.edge2).array());
  return bounds;
}

/// The plane of 12 per axis with the least expected work (surface area heuristic).
RayCaster::Split RayCaster::BestSplit(std::uint32_t first, std::uint32_t count,
                                      const Bounds& centres) const {
  constexpr int kBins = 12;
  Split best;
  float least = 1e30f;
  for (int axis = 0; axis < 3; ++axis) {
    const float low = centres.low[axis], extent = centres.high[axis] - low;
    if (extent < 1e-6f) continue;
    std::array<Bounds, kBins> bins;
    std::array<std::uint32_t, kBins> counts{};
    for (std::uint32_t i = first; i < first + count; ++i) {
      const Bounds b = BoundsOf(triangles_[i]);
      const auto bin = static_cast<std::size_t>(
          std::min((b.Centre()[axis] - low) / extent * kBins, kBins - 1.0f));
      bins[bin].Add(b);
      ++counts[bin];
    }
    for (int cut = 1; cut < kBins; ++cut) {
      Bounds left, right;
      std::uint32_t left_count = 0, right_count = 0;
      for (std::size_t k = 0; k < kBins; ++k) {
        const bool is_left = static_cast<int>(k) < cut;
        (is_left ? left : right).Add(bins[k]);
        (is_left ? left_count : right_count) += counts[k];
      }
      if (left_count == 0 || right_count == 0) continue;
      const float cost = left.HalfArea() * static_cast<float>(left_count) +
                         right.HalfArea() * static_cast<float>(right_count);
      if (cost < least) {
        least = cost;
        best = {axis, low + extent * static_cast<float>(cut) / kBins};
      }
    }
  }
  // Rounding may have put a centre on the other side of the plane: then this stays a leaf.
  if (best.axis >= 0) {
    const auto below = static_cast<std::uint32_t>(std::count_if(
        triangles_.begin() + first, triangles_.begin() + first + count,
        [&](const Triangle& t) { return BoundsOf(t).Centre()[best.axis] < best.position; }));
    if (below == 0 || below == count) best.axis = -1;
  }
  return best;
}

template <bool kAny>
std::optional<RayHit> RayCaster::Trace(const Eigen::Vector3f& origin,
                                       const Eigen::Vector3f& direction, float max_distance) const {
  const Eigen::Array3f inverse = direction.array().inverse();
  RayHit best;
  best.distance = max_distance;
  struct Pending {
    std::uint32_t node;
    float near;
  };
  std::array<Pending, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, 0};
  const auto enter = [&](const Node& node) {
    const Eigen::Array3f a = (node.low - origin.array()) * inverse;
    const Eigen::Array3f b = (node.high - origin.array()) * inverse;
    const float near = a.min(b).maxCoeff(), far = a.max(b).minCoeff();
    return near <= far && far >= 0 && near < best.distance ? near : 1e10f;
  };
  while (depth > 0) {
    const Pending pending = stack[--depth];
    if (pending.near >= best.distance) continue;
    const Node& node = nodes_[pending.node];
    if (node.count == 0) {
      const float left = enter(nodes_[node.first]), right = enter(nodes_[node.first + 1]);
      const Pending a{node.first, left}, b{node.first + 1, right};
      const bool left_first = left < right;
      const Pending& near = left_first ? a : b;
      const Pending& far = left_first ? b : a;
      if (far.near < 1e9f && depth < stack.size()) stack[depth++] = far;
      if (near.near < 1e9f && depth < stack.size()) stack[depth++] = near;
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
