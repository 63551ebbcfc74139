#pragma once

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <array>
#include <atomic>

#include "server/filter/point_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// What the least squares problems of this folder share, as Ceres wants it.

template <typename T>
using Vec3 = Eigen::Matrix<T, 3, 1>;

/// Keyframe: [x y z w | translation], as Eigen stores them.
using PoseBlock = std::array<double, 7>;
/// Point: [tangent u v | inverse range].
using PointBlock = std::array<double, 3>;
using PoseManifold =
    ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;

inline PoseBlock Pack(const Rigid3& pose) {
  PoseBlock block;
  Eigen::Map<Eigen::Quaterniond>(block.data()) = pose.rotation;
  Eigen::Map<Eigen::Vector3d>(block.data() + 4) = pose.translation;
  return block;
}

inline Rigid3 Unpack(const PoseBlock& block) {
  return {Eigen::Map<const Eigen::Quaterniond>(block.data()).normalized(),
          Eigen::Map<const Eigen::Vector3d>(block.data() + 4)};
}

/// A bearing moved in the tangent plane that it started with.
struct BearingOf {
  Eigen::Vector3d bearing;
  Eigen::Matrix<double, 3, 2> basis;

  template <typename T>
  Vec3<T> operator()(const T* point) const {
    const Vec3<T> moved =
        bearing.cast<T>() + basis.col(0).cast<T>() * point[0] + basis.col(1).cast<T>() * point[1];
    return moved.normalized();
  }
};

/// The direction (any length) in which `camera` sees a point of `anchor`, in the camera.
template <typename T>
Vec3<T> DirectionIn(const T* camera, const T* anchor, const T* point, const BearingOf& bearing) {
  const Eigen::Map<const Eigen::Quaternion<T>> turn_camera(camera), turn_anchor(anchor);
  const Eigen::Map<const Vec3<T>> at_camera(camera + 4), at_anchor(anchor + 4);
  const Vec3<T> in_world = turn_anchor * bearing(point) + point[2] * (at_anchor - at_camera);
  return turn_camera.conjugate() * in_world;
}

/// Ends a solution from another thread.
class Stopper : public ceres::IterationCallback {
 public:
  explicit Stopper(const std::atomic<bool>& stop) : stop_(stop) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return stop_ ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const std::atomic<bool>& stop_;
};

}  // namespace saccade
