// T1: every analytic Jacobian against central differences, 1000 random states, 1e-6.
#include <gtest/gtest.h>

#include "server/filter/motion_model.hpp"
#include "server/filter/point_model.hpp"
#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::jacobian_test {
namespace {

constexpr int kStates = 1000;
constexpr double kStep = 1e-5;
constexpr double kTolerance = 1e-6;

Rigid3 Moved(const Rigid3& pose, const Eigen::Matrix<double, 6, 1>& error) {
  return {pose.rotation * ExpQuaternion(error.tail<3>()), pose.translation + error.head<3>()};
}

TEST(MotionJacobians, MatchCentralDifferencesT1) {
  RandomWorld world(1);
  for (int k = 0; k < kStates; ++k) {
    const CameraMotion camera = world.Motion();
    const double dt = world.Uniform(0.001, 0.05);
    const MotionNoise noise{1.0 / dt, 1.0 / dt};  // so that q = G G^T
    const MotionJacobians jacobians =
        LineariseMotion(camera, camera.world_from_camera.rotation, dt, noise);
    const CameraMotion next = PropagateMotion(camera, dt);
    Matrix12d f;
    for (int c = 0; c < 12; ++c) {
      const Vector12d step = kStep * Vector12d::Unit(c);
      f.col(c) = (Minus(PropagateMotion(Plus(camera, step), dt), next) -
                  Minus(PropagateMotion(Plus(camera, -step), dt), next)) /
                 (2 * kStep);
    }
    Eigen::Matrix<double, 12, 6> g;
    for (int c = 0; c < 6; ++c) {
      const Eigen::Matrix<double, 6, 1> step = kStep * Eigen::Matrix<double, 6, 1>::Unit(c);
      g.col(c) = (Minus(PropagateMotion(camera, dt, step), next) -
                  Minus(PropagateMotion(camera, dt, -step), next)) /
                 (2 * kStep);
    }
    ASSERT_LT(RelativeError(jacobians.f, f), kTolerance);
    ASSERT_LT(RelativeError(jacobians.q, Matrix12d(g * g.transpose())), kTolerance);
  }
}

struct Sight {
  Rigid3 camera;
  PointFromClone point;
};

/// a point of a clone that both its clone and the camera see.
Sight RandomSight(RandomWorld& world, const CameraModel& lens) {
  while (true) {
    Sight sight;
    sight.camera = world.Pose();
    Eigen::Matrix<double, 6, 1> apart;
    apart << world.NormalVector<3>(0.5), world.NormalVector<3>(0.2);
    sight.point.world_from_clone = Moved(sight.camera, apart);
    sight.point.bearing = *lens.Unproject({world.Uniform(40, 600), world.Uniform(40, 440)});
    sight.point.basis = TangentBasis(sight.point.bearing);
    MoveBearing(0.01 * world.NormalVector<2>(), sight.point.bearing, sight.point.basis);
    sight.point.inverse_range = world.Uniform(0.05, 1.5);
    const auto at = PredictFromClone(lens, sight.camera, sight.point);
    if (at && at->ray.z() > 0.2 && lens.InImage(at->pixel)) return sight;
  }
}

template <int kSize, typename Function>
Eigen::Matrix<double, 2, kSize> Differences(const Function& pixel_after) {
  Eigen::Matrix<double, 2, kSize> jacobian;
  for (int c = 0; c < kSize; ++c) {
    const Eigen::Matrix<double, kSize, 1> step = kStep * Eigen::Matrix<double, kSize, 1>::Unit(c);
    jacobian.col(c) = (pixel_after(step) - pixel_after(-step)) / (2 * kStep);
  }
  return jacobian;
}

TEST(PointJacobians, FromCloneMatchCentralDifferencesT1) {
  RandomWorld world(2);
  const CameraModel lens = TestCamera();
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  for (int k = 0; k < kStates; ++k) {
    const Sight sight = RandomSight(world, lens);
    const PixelPrediction at = *PredictFromClone(lens, sight.camera, sight.point);
    const auto by_camera = Differences<6>([&](const Vector6& step) -> Eigen::Vector2d {
      return *PixelFromClone(lens, Moved(sight.camera, step), sight.point);
    });
    const auto by_clone = Differences<6>([&](const Vector6& step) -> Eigen::Vector2d {
      PointFromClone moved = sight.point;
      moved.world_from_clone = Moved(moved.world_from_clone, step);
      return *PixelFromClone(lens, sight.camera, moved);
    });
    const auto by_point = Differences<3>([&](const Eigen::Vector3d& step) -> Eigen::Vector2d {
      PointFromClone moved = sight.point;
      MoveBearing(step.head<2>(), moved.bearing, moved.basis);
      moved.inverse_range += step[2];
      return *PixelFromClone(lens, sight.camera, moved);
    });
    ASSERT_LT(RelativeError(at.d_camera, by_camera), kTolerance);
    ASSERT_LT(RelativeError(at.d_clone, by_clone), kTolerance);
    ASSERT_LT(RelativeError(at.d_point, by_point), kTolerance);
  }
}

TEST(PointJacobians, FixedMatchCentralDifferencesT1) {
  RandomWorld world(3);
  const CameraModel lens = TestCamera();
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  for (int k = 0; k < kStates; ++k) {
    const Rigid3 camera = world.Pose();
    const Eigen::Vector3d point =
        camera * Eigen::Vector3d(world.Uniform(1.0, 4.0) *
                                 *lens.Unproject({world.Uniform(40, 600), world.Uniform(40, 440)}));
    const PixelPrediction at = *PredictFixed(lens, camera, point);
    const auto by_camera = Differences<6>([&](const Vector6& step) -> Eigen::Vector2d {
      return PredictFixed(lens, Moved(camera, step), point)->pixel;
    });
    ASSERT_LT(RelativeError(at.d_camera, by_camera), kTolerance);
  }
}

TEST(TangentBasis, StaysOrthonormalWhileTheBearingMoves) {
  RandomWorld world(4);
  Eigen::Vector3d bearing = world.NormalVector<3>().normalized();
  Eigen::Matrix<double, 3, 2> basis = TangentBasis(bearing);
  for (int k = 0; k < 10000; ++k) MoveBearing(0.02 * world.NormalVector<2>(), bearing, basis);
  Eigen::Matrix3d all;
  all << basis, bearing;
  EXPECT_LT((all.transpose() * all - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace saccade::jacobian_test
