#include "server/eval/landmarks/hall_thing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace saccade {

using Eigen::Vector3d;

Eigen::AlignedBox3d ThingInHall(HallMotion motion, double time_s) {
  constexpr double kTop = -1.2, kFloor = 1.4;
  if (motion == HallMotion::kPillar) {
    return {Vector3d(0.92, kTop, 1.6), Vector3d(1.26, kFloor, 1.9)};
  }
  if (motion != HallMotion::kPasser) return {};
  // There and back in eight seconds, out of the view at both ends.
  const double x = 1.1 + 2.2 * std::sin(2.0 * std::numbers::pi * time_s / 8.0);
  return {Vector3d(x - 0.22, -0.55, 1.35), Vector3d(x + 0.22, kFloor, 1.6)};
}

std::optional<double> EntersBox(const Eigen::AlignedBox3d& box, const Vector3d& origin,
                                const Vector3d& direction) {
  if (box.isEmpty()) return std::nullopt;
  double enter = 0.0, leave = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.min()[axis] - origin[axis]) / direction[axis];
    const double b = (box.max()[axis] - origin[axis]) / direction[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (!(enter > 0.0 && enter <= leave)) return std::nullopt;
  return enter;
}

double LookOfThing(const Vector3d& point_in_world) {
  const double u = point_in_world.x() + point_in_world.z(), v = point_in_world.y();
  const int check = static_cast<int>(std::floor(u / 0.05)) + static_cast<int>(std::floor(v / 0.07));
  return (check % 2 == 0 ? 52.0 : 196.0) + 14.0 * std::sin(40.0 * u + 23.0 * v);
}

}  // namespace saccade
