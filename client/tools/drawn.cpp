#include "client/tools/drawn.hpp"

#include <algorithm>
#include <cmath>

namespace saccade::tools {
namespace {

constexpr double kLeastM = 0.01, kMostM = 10;  // annotation.proto
constexpr std::size_t kMostPoints = 2000;

}  // namespace

Plane PlaneOf(const View& view, const Landing& landing) {
  const Eigen::Vector3d facing = view.world_from_camera.rotation * Eigen::Vector3d::UnitZ();
  return {landing.point_in_world, landing.normal_in_world.value_or(facing), 0};
}

std::optional<Eigen::Vector3d> OnPlane(const View& view, const Plane& plane,
                                       const Eigen::Vector2d& pixel) {
  const std::optional<Eigen::Vector3d> direction = view.Ray(pixel);
  if (!direction) return std::nullopt;
  return Intersect(plane, view.eye(), *direction);
}

DrawnBox BoxBetween(const View& view, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d right = view.world_from_camera.rotation * Eigen::Vector3d::UnitX();
  const Eigen::Quaterniond upright(
      Eigen::AngleAxisd(std::atan2(-right.z(), right.x()), Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d across = (upright.conjugate() * (b - a)).cwiseAbs();
  Eigen::Vector3d sides = across;
  std::sort(sides.data(), sides.data() + 3);
  const double depth = sides[0] < 0.25 * sides[1] ? 0.5 * sides[1] : 0;
  return {0.5 * (a + b), upright, across.cwiseMax(std::max(depth, kLeastM)).cwiseMin(kMostM)};
}

std::vector<Eigen::Vector3d> StrokeOf(const std::vector<Eigen::Vector3d>& points_in_world) {
  const std::size_t count = points_in_world.size();
  if (count < 2) return {};
  std::vector<Eigen::Vector3d> offsets;
  const std::size_t step = (count + kMostPoints - 1) / kMostPoints;
  for (std::size_t i = 0; i < count; i += step) {
    const Eigen::Vector3d& at = points_in_world[i];
    const bool end = i == 0 || i + step >= count;
    const Eigen::Vector3d smooth =
        end ? at : 0.25 * points_in_world[i - 1] + 0.5 * at + 0.25 * points_in_world[i + 1];
    offsets.emplace_back(smooth - points_in_world[0]);
  }
  return offsets;
}

}  // namespace saccade::tools
