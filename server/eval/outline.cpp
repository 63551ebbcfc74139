#include "server/eval/outline.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace saccade {

bool IsOnOutline(const SimSource& source, const Eigen::Vector3d& eye,
                 const Eigen::Vector3d& point) {
  constexpr double kBeside_rad = 0.012;  // 6 px
  constexpr double kSameSurface = 0.05;  // of the distance
  const Eigen::Vector3d line = point - eye;
  const Eigen::Vector3d ray = line.normalized();
  const Eigen::Vector3d across = ray.cross(Eigen::Vector3d::UnitY()).normalized();
  for (int k = 0; k < 8; ++k) {
    const Eigen::AngleAxisd round(k * std::numbers::pi / 4.0, ray);
    const Eigen::Vector3d beside = (ray + kBeside_rad * (round * across)).normalized();
    const std::optional<double> surface = source.SurfaceAlong(eye, beside);
    if (!surface || std::abs(*surface - line.norm()) > kSameSurface * line.norm()) return true;
  }
  return false;
}

bool IsOnASurface(const SimSource& source, const Eigen::Vector3d& eye,
                  const Eigen::Vector3d& point) {
  constexpr double kFalseDepth = 0.3;  // relative
  constexpr double kOnePixel_rad = 0.002;
  const double believed = (point - eye).norm();
  const Eigen::Vector3d ray = (point - eye) / believed;
  const Eigen::Vector3d across = ray.unitOrthogonal();
  for (int k = -1; k < 8; ++k) {
    const Eigen::AngleAxisd round(std::max(k, 0) * std::numbers::pi / 4.0, ray);
    const double beside = k < 0 ? 0.0 : kOnePixel_rad;
    const std::optional<double> real =
        source.SurfaceAlong(eye, (ray + beside * (round * across)).normalized());
    if (real && std::abs(believed / *real - 1) <= kFalseDepth) return true;
  }
  return false;
}

}  // namespace saccade
