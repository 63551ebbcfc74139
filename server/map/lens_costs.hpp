#pragma once

#include "server/map/bundle_costs.hpp"
#include "server/map/lens_adjustment.hpp"

namespace saccade {

/// Sightings as pixels of a lens that is adjusted too; in sigmas.
struct PixelError {
  Eigen::Vector2d pixel;
  double sigma_px;

  /// `direction` of any length, in the camera. False: behind it.
  template <typename T>
  bool operator()(const T* lens, const Vec3<T>& direction, T* residual) const {
    constexpr double kBehind = 1e-2;  // cosine below which nothing is seen
    if (direction.z() < T(kBehind) * direction.norm()) return false;
    const T x = direction.x() / direction.z(), y = direction.y() / direction.z();
    const T r2 = x * x + y * y;
    const T f = exp(lens[0]), bent = T(1.0) + r2 * (lens[3] + r2 * (lens[4] + r2 * lens[7]));
    const T &p1 = lens[5], &p2 = lens[6];
    const T u = bent * x + T(2.0) * p1 * x * y + p2 * (r2 + T(2.0) * x * x);
    const T v = bent * y + p1 * (r2 + T(2.0) * y * y) + T(2.0) * p2 * x * y;
    residual[0] = (f * u + lens[1] - T(pixel.x())) / T(sigma_px);
    residual[1] = (f * v + lens[2] - T(pixel.y())) / T(sigma_px);
    return true;
  }
};

struct LensSightingCost {
  PixelError error;
  BearingOf bearing;

  template <typename T>
  bool operator()(const T* lens, const T* camera, const T* anchor, const T* point,
                  T* residual) const {
    return error(lens, DirectionIn(camera, anchor, point, bearing), residual);
  }
};

/// Where it was first seen; and a range that nothing tells of stays about where it is.
struct LensBirthCost {
  PixelError error;
  BearingOf bearing;
  double inverse_range, inverse_range_sigma;

  template <typename T>
  bool operator()(const T* lens, const T* point, T* residual) const {
    residual[2] = (point[2] - T(inverse_range)) / T(inverse_range_sigma);
    return error(lens, bearing(point), residual);
  }
};

struct LensKnownCost {
  PixelError error;
  Eigen::Vector3d point;

  template <typename T>
  bool operator()(const T* lens, const T* camera, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> turn(camera);
    const Eigen::Map<const Vec3<T>> at(camera + 4);
    return error(lens, Vec3<T>(turn.conjugate() * (point.cast<T>() - at)), residual);
  }
};

struct LensPriorCost {
  LensVector mean;
  LensMatrix root;  // of the information: root^T root

  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    const Eigen::Map<const Eigen::Matrix<T, kLensSize, 1>> at(lens);
    Eigen::Map<Eigen::Matrix<T, kLensSize, 1>> error(residual);
    error = root.cast<T>() * (at - mean.cast<T>());
    return true;
  }
};

}  // namespace saccade
