#include "shared/scene/surface_ray.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace saccade {
namespace {

/// Where the ray is inside the chunk's cube; nothing: it passes by.
std::optional<std::pair<float, float>> Inside(const SurfaceChunk& chunk,
                                              const Eigen::Vector3f& origin,
                                              const Eigen::Vector3f& inverse_ray) {
  const Eigen::Array3f low = (chunk.origin_in_world - origin).array() * inverse_ray.array();
  const Eigen::Array3f high = (chunk.origin_in_world - origin).array() * inverse_ray.array() +
                              chunk.span * chunk.step_m * inverse_ray.array();
  const float enters = low.min(high).maxCoeff();
  const float leaves = low.max(high).minCoeff();
  if (!(leaves >= enters) || leaves < 0.0f) return std::nullopt;
  return std::pair(enters, leaves);
}

/// Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection", 1997.
std::optional<float> MeetTriangle(const Eigen::Vector3f& a, const Eigen::Vector3f& ab,
                                  const Eigen::Vector3f& ac, const Eigen::Vector3f& origin,
                                  const Eigen::Vector3f& ray) {
  const Eigen::Vector3f p = ray.cross(ac);
  const float determinant = ab.dot(p);
  if (determinant == 0.0f) return std::nullopt;
  const Eigen::Vector3f from_a = origin - a;
  const float u = from_a.dot(p) / determinant;
  if (u < 0.0f || u > 1.0f) return std::nullopt;
  const Eigen::Vector3f q = from_a.cross(ab);
  const float v = ray.dot(q) / determinant;
  if (v < 0.0f || u + v > 1.0f) return std::nullopt;
  return ac.dot(q) / determinant;
}

}  // namespace

std::optional<SurfaceHit> CastOnSurface(const SurfaceSnapshot& surface,
                                        const Eigen::Vector3d& origin_in_world,
                                        const Eigen::Vector3d& ray_in_world, double nearest) {
  const Eigen::Vector3f origin = origin_in_world.cast<float>(), ray = ray_in_world.cast<float>();
  const Eigen::Vector3f inverse = ray.unaryExpr([](float along) {
    constexpr float kLeast = 1e-9f;
    return 1.0f / (std::abs(along) > kLeast ? along : std::copysign(kLeast, along));
  });
  std::vector<std::pair<float, const SurfaceChunk*>> passed;
  for (const auto& [index, chunk] : surface.chunks) {
    if (chunk->triangles.empty()) continue;
    if (const auto inside = Inside(*chunk, origin, inverse)) {
      passed.emplace_back(inside->first, chunk.get());
    }
  }
  std::sort(passed.begin(), passed.end());
  float range = std::numeric_limits<float>::max();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  for (const auto& [enters, chunk] : passed) {
    if (enters > range) break;
    for (const SurfaceChunk::Triangle& triangle : chunk->triangles) {
      const Eigen::Vector3f a = chunk->Point(triangle[0]);
      const Eigen::Vector3f ab = chunk->Point(triangle[1]) - a, ac = chunk->Point(triangle[2]) - a;
      const std::optional<float> meets = MeetTriangle(a, ab, ac, origin, ray);
      if (!meets || *meets <= static_cast<float>(nearest) || *meets >= range) continue;
      range = *meets;
      normal = ab.cross(ac);
    }
  }
  if (range == std::numeric_limits<float>::max()) return std::nullopt;
  SurfaceHit hit;
  hit.range = range;
  hit.normal_in_world = normal.cast<double>().normalized();
  if (hit.normal_in_world.dot(ray_in_world) > 0.0) hit.normal_in_world *= -1.0;
  return hit;
}

}  // namespace saccade
