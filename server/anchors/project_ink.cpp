#include <cmath>

#include "server/anchors/click.hpp"

namespace saccade {

std::vector<Eigen::Vector3d> ProjectInk(const std::vector<Eigen::Vector2d>& ink_px,
                                        const ResolvedTarget& target) {
  std::vector<Eigen::Vector3d> offsets;
  if (!target.view) return offsets;
  const ResolvedTarget::View& view = *target.view;
  const Eigen::Vector3d origin = view.world_from_camera.translation;
  for (const Eigen::Vector2d& pixel : ink_px) {
    const std::optional<Eigen::Vector3d> bearing = view.past.frame->camera->Unproject(pixel);
    if (!bearing) continue;
    const Eigen::Vector3d ray = view.world_from_camera.rotation * *bearing;
    const double cosine = ray.dot(target.normal_in_world);
    double t = (target.point_in_world - origin).dot(target.normal_in_world) / cosine;
    const bool hits = std::abs(cosine) > 0.1 && t > 0.5 * view.depth_m && t < 2.0 * view.depth_m;
    if (!hits) t = view.depth_m;
    offsets.push_back(origin + t * ray - target.point_in_world);
  }
  return offsets;
}

}  // namespace saccade
