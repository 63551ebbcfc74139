#include "server/anchors/surface_look.hpp"

#include <algorithm>
#include <cmath>

#include "shared/scene/surface_ray.hpp"

namespace saccade {
namespace {

constexpr int kBeside = 8;
constexpr double kBeside_px = 5.0;
constexpr double kOtherShare = 0.04;     // of the range, from the plane of the surface: another one
constexpr double kSurfaceShare = 0.010;  // sigma, of the range
constexpr double kSurfaceVoxels = 0.5;
constexpr double kShallow = 0.15;  // cosine: a plane seen so flat says nothing of its neighbours
constexpr double kAgree_sigma = 3.0;
constexpr double kMeant = 0.3;       // that the other of two surfaces was meant
constexpr double kHoleShare = 0.08;  // sigma, of the range: measured, 2026-12-01-clicks.md

}  // namespace

std::optional<SurfaceLook> LookAtSurface(const SurfaceSnapshot& surface,
                                         const Eigen::Vector3d& eye_in_world,
                                         const Eigen::Vector3d& ray_in_world,
                                         double radians_per_px) {
  const std::optional<SurfaceHit> hit = CastOnSurface(surface, eye_in_world, ray_in_world);
  if (!hit) return std::nullopt;
  SurfaceLook look;
  look.range_m = hit->range;
  look.normal_in_world = hit->normal_in_world;
  const double cosine = std::max(kShallow, -hit->normal_in_world.dot(ray_in_world));
  look.sigma_m = std::hypot(kSurfaceShare * hit->range,
                            kSurfaceVoxels * static_cast<double>(surface.voxel) / cosine);
  const Eigen::Vector3d across = ray_in_world.unitOrthogonal();
  const Eigen::Vector3d up = ray_in_world.cross(across);
  for (int k = 0; k < kBeside; ++k) {
    const double angle = 2.0 * M_PI * k / kBeside, turn = kBeside_px * radians_per_px;
    const Eigen::Vector3d ray =
        (ray_in_world + turn * (std::cos(angle) * across + std::sin(angle) * up)).normalized();
    const std::optional<SurfaceHit> beside = CastOnSurface(surface, eye_in_world, ray);
    if (!beside) {
      look.outline = true;
      continue;
    }
    const double flat = std::max(kShallow, -hit->normal_in_world.dot(ray));
    const double expected = hit->range * cosine / flat;
    if (std::abs(beside->range - expected) < kOtherShare * hit->range) continue;
    look.outline = true;
    look.other_range_m = beside->range;
  }
  return look;
}

std::vector<SurfaceSample> SurfaceAround(const SurfaceSnapshot& surface,
                                         const Rigid3& ray_from_world, double radians_per_px) {
  constexpr int kLooks = 48;
  constexpr double kNearest_px = 8.0, kFarthest_px = 170.0;
  constexpr double kGolden_rad = 2.39996;  // successive looks spread evenly all round
  const Rigid3 world_from_ray = ray_from_world.Inverse();
  std::vector<SurfaceSample> samples;
  for (int k = 0; k < kLooks; ++k) {
    const double far = static_cast<double>(k) / (kLooks - 1);
    const double turn =
        radians_per_px * (kNearest_px + (kFarthest_px - kNearest_px) * std::pow(far, 1.5));
    const Eigen::Vector3d beside(turn * std::cos(k * kGolden_rad), turn * std::sin(k * kGolden_rad),
                                 1.0);
    const Eigen::Vector3d ray = (world_from_ray.rotation * beside).normalized();
    const std::optional<SurfaceHit> hit = CastOnSurface(surface, world_from_ray.translation, ray);
    if (!hit) continue;
    SurfaceSample sample;
    sample.point_in_ray = hit->range * beside.normalized();
    sample.depth_sigma_m = kSurfaceShare * hit->range;
    sample.depth_known = true;
    samples.push_back(sample);
  }
  return samples;
}

void DoubtHole(const SurfaceDepth& depth, DepthDoubt& doubt) {
  if (depth.at_feature) return;
  // A patch at the very pixel, once it is measured, knows better: that is `relief`.
  doubt.clutter_sigma_m = std::max(doubt.clutter_sigma_m, kHoleShare * depth.depth_m);
}

void TakeSurface(const SurfaceLook& look, SurfaceDepth& depth, DepthDoubt& doubt) {
  const double apart_m = std::abs(look.range_m - depth.depth_m);
  const bool agrees = apart_m < kAgree_sigma * std::hypot(look.sigma_m, depth.sigma_m);
  if (look.outline) {
    const double other_m =
        look.other_range_m > 0.0 ? std::abs(look.other_range_m - look.range_m) : 0.0;
    doubt.relief_sigma_m = std::max(doubt.relief_sigma_m, kMeant * std::max(other_m, apart_m));
    doubt.clutter_sigma_m = std::max(doubt.clutter_sigma_m, doubt.relief_sigma_m);
    if (look.other_range_m == 0.0) DoubtHole(depth, doubt);
    return;
  }
  const bool finer = depth.at_feature && agrees && depth.sigma_m < look.sigma_m;
  if (finer) return;
  depth.method = AnchorMethod::kScene;
  depth.depth_m = look.range_m;
  depth.sigma_m = look.sigma_m;
  depth.at_feature.reset();
  doubt.clutter_sigma_m = doubt.relief_sigma_m = look.sigma_m;
}

}  // namespace saccade
