#include "client/tools/plane.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace saccade::tools {

std::optional<Plane> FitPlane(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < 3) return std::nullopt;
  const double count = static_cast<double>(points.size());
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) centre += point / count;
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) {
    moments += (point - centre) * (point - centre).transpose() / count;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments);
  if (std::sqrt(std::max(axes.eigenvalues()[1], 0.0)) < 1e-6) return std::nullopt;
  return Plane{centre, axes.eigenvectors().col(0), std::sqrt(std::max(axes.eigenvalues()[0], 0.0))};
}

std::optional<Eigen::Vector3d> Intersect(const Plane& plane, const Eigen::Vector3d& origin,
                                         const Eigen::Vector3d& direction) {
  const double along = direction.dot(plane.normal);
  if (std::abs(along) < 1e-3) return std::nullopt;
  const double t = (plane.point - origin).dot(plane.normal) / along;
  if (t <= 0) return std::nullopt;
  return origin + t * direction;
}

}  // namespace saccade::tools
