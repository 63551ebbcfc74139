// M3 (T1, T7), its filter in information form (T4), and what it gains on a constant twist.
#include "server/filter/koller_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "server/filter/constant_velocity.hpp"
#include "server/filter/landmark_filter.hpp"
#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::koller_motion_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

KollerMotion RandomMotion(RandomWorld& world, double turn) {
  return {world.Pose(), world.NormalVector<3>(0.8), world.NormalVector<3>(turn),
          world.NormalVector<3>(3.0)};
}

/// p. = v + w x p, v. = a; R. = [w]x R, by Runge and Kutta in `steps`.
KollerMotion ByRungeKutta(const KollerMotion& motion, double dt, int steps) {
  const Vector3d w = motion.angular_velocity_rad_s, a = motion.acceleration_m_s2;
  Vector3d p = motion.camera_from_world.translation, v = motion.velocity_m_s;
  Eigen::Matrix3d turn = motion.camera_from_world.RotationMatrix();
  const double h = dt / steps;
  const Eigen::Matrix3d x = Skew(w);
  for (int k = 0; k < steps; ++k) {
    const Vector3d middle = v + 0.5 * h * a, end = v + h * a;
    const Vector3d k1 = v + w.cross(p), k2 = middle + w.cross(p + 0.5 * h * k1),
                   k3 = middle + w.cross(p + 0.5 * h * k2), k4 = end + w.cross(p + h * k3);
    p += h / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4);
    v = end;
    const Eigen::Matrix3d m1 = x * turn, m2 = x * (turn + 0.5 * h * m1),
                          m3 = x * (turn + 0.5 * h * m2), m4 = x * (turn + h * m3);
    turn += h / 6.0 * (m1 + 2 * m2 + 2 * m3 + m4);
  }
  KollerMotion next = motion;
  next.camera_from_world = {Eigen::Quaterniond(turn).normalized(), p};
  next.velocity_m_s = v;
  return next;
}

TEST(KollerMotion, ClosedFormIsWhatRungeKuttaFindsT7) {
  RandomWorld world(1);
  for (int k = 0; k < 300; ++k) {
    // From angles at which the closed form has no digit left to three radians.
    const double turn = std::pow(10.0, world.Uniform(-7.0, 1.5));
    const KollerMotion motion = RandomMotion(world, turn);
    const double dt = world.Uniform(0.005, 0.1);
    const Vector15d apart =
        Minus(PropagateKoller(motion, dt), ByRungeKutta(motion, dt, turn > 3.0 ? 2000 : 200));
    ASSERT_LT(apart.cwiseAbs().maxCoeff(), 1e-9) << "turn " << turn << " rad/s, " << dt << " s";
  }
}

TEST(KollerMotion, JacobiansMatchCentralDifferencesT1) {
  RandomWorld world(2);
  constexpr double kStep = 1e-5;
  for (int k = 0; k < 1000; ++k) {
    const KollerMotion motion = RandomMotion(world, k % 2 == 0 ? 2.0 : 12.0);
    const double dt = world.Uniform(0.002, 0.1);
    const KollerJacobians by = LineariseKoller(motion, dt, {1.0 / dt, 1.0 / dt});
    const KollerMotion next = PropagateKoller(motion, dt);
    Matrix15d f;
    for (int c = 0; c < 15; ++c) {
      const Vector15d step = kStep * Vector15d::Unit(c);
      f.col(c) = (Minus(PropagateKoller(Plus(motion, step), dt), next) -
                  Minus(PropagateKoller(Plus(motion, -step), dt), next)) /
                 (2 * kStep);
    }
    Eigen::Matrix<double, 15, 6> g;
    for (int c = 0; c < 6; ++c) {
      const Eigen::Matrix<double, 6, 1> step = kStep * Eigen::Matrix<double, 6, 1>::Unit(c);
      g.col(c) = (Minus(PropagateKoller(motion, dt, step), next) -
                  Minus(PropagateKoller(motion, dt, -step), next)) /
                 (2 * kStep);
    }
    ASSERT_LT(RelativeError(by.f, f), 1e-6);
    ASSERT_LT(RelativeError(by.q, Matrix15d(g * g.transpose())), 1e-6);
  }
}

TEST(KollerMotion, PoseJacobiansAreEachOthersInverseAndMatchDifferences) {
  RandomWorld world(3);
  for (int k = 0; k < 100; ++k) {
    const KollerMotion motion = RandomMotion(world, 1.0);
    const Matrix6d to = ToCameraPose(motion.camera_from_world);
    ASSERT_LT((to * FromCameraPose(motion.camera_from_world) - Matrix6d::Identity()).norm(), 1e-12);
    Matrix6d numeric;
    for (int c = 0; c < 6; ++c) {
      const auto at = [&](double step) {
        const CameraMotion moved = ToCameraMotion(Plus(motion, step * Vector15d::Unit(c)));
        return Vector12d(Minus(moved, ToCameraMotion(motion)));
      };
      numeric.col(c) = (at(1e-5) - at(-1e-5)).head<6>() / 2e-5;
    }
    ASSERT_LT(RelativeError(to, numeric), 1e-6);
  }
}

TEST(KollerMotion, IsTheProductsMotionInItsConvention) {
  RandomWorld world(4);
  const KollerMotion motion = RandomMotion(world, 1.0);
  const CameraMotion camera = ToCameraMotion(motion);
  const CameraMotion later = ToCameraMotion(PropagateKoller(motion, 1e-6));
  EXPECT_LT(((later.world_from_camera.translation - camera.world_from_camera.translation) / 1e-6 -
             camera.velocity_m_s)
                .norm(),
            1e-4);
  const Eigen::Quaterniond turned =
      camera.world_from_camera.rotation.conjugate() * later.world_from_camera.rotation;
  EXPECT_LT((LogQuaternion(turned) / 1e-6 - camera.angular_velocity_rad_s).norm(), 1e-4);
}

/// Corners of eight squares on a wall.
std::vector<Vector3d> WallOfSquares() {
  std::vector<Vector3d> corners;
  for (int k = 0; k < 8; ++k) {
    const Vector3d middle(0.45 * (k % 4) - 0.68, 0.5 * (k / 4) - 0.25, 2.0 + 0.1 * (k % 3));
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      corners.emplace_back(middle + 0.08 * Vector3d(x, y, 0));
    }
  }
  return corners;
}

TEST(LandmarkFilter, InformationFormAgreesWithKalmansT4) {
  RandomWorld world(5);
  const CameraModel lens = TestCamera();
  LandmarkFilter filter;
  filter.Reset({ExpQuaternion(Vector3d(0.05, -0.03, 0.1)), {0.05, 0.02, -0.1}},
               1e-4 * Matrix6d::Identity());
  filter.Predict(0.033, {});
  std::vector<KnownSight> seen;
  for (const Vector3d& corner : WallOfSquares()) {
    const auto at = filter.Predicted(lens, corner);
    if (!at) continue;
    const Eigen::Matrix2d root = Eigen::Matrix2d::Identity() * 0.2;
    seen.push_back({corner, at->at.pixel + world.NormalVector<2>(0.5), root * root});
  }
  ASSERT_GE(seen.size(), 16u);
  const Matrix15d p = filter.covariance();
  const KollerMotion before = filter.motion();
  const auto m = 2 * static_cast<Eigen::Index>(seen.size());
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(m, 15), r = Eigen::MatrixXd::Zero(m, m);
  Eigen::VectorXd z(m);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const auto at = filter.Predicted(lens, seen[k].point_in_world);
    const auto row = 2 * static_cast<Eigen::Index>(k);
    h.block<2, 6>(row, 0) = at->at.d_camera * ToCameraPose(before.camera_from_world);
    r.block<2, 2>(row, row) = seen[k].noise;
    z.segment<2>(row) = seen[k].pixel - at->at.pixel;
  }
  const Eigen::MatrixXd gain =
      p * h.transpose() * (h * p * h.transpose() + r).ldlt().solve(Eigen::MatrixXd::Identity(m, m));
  const Vector15d error = gain * z;
  Matrix15d carry = Matrix15d::Identity();
  carry.block<3, 3>(3, 3) = RightJacobianSo3(error.segment<3>(3));
  const Matrix15d after = carry * (p - gain * h * p) * carry.transpose();
  const auto report = filter.Update(lens, seen);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_LT(RelativeError(Minus(filter.motion(), before), error), 1e-9);
  EXPECT_LT(RelativeError(filter.covariance(), after), 1e-9);
  EXPECT_NEAR(report->nis, z.dot((h * p * h.transpose() + r).ldlt().solve(z)), 1e-6 * report->nis);
}

TEST(LandmarkFilter, RefusesWhatItCannotUseAndStaysAsItWas) {
  const CameraModel lens = TestCamera();
  LandmarkFilter filter;
  filter.Reset(Rigid3(), 1e-4 * Matrix6d::Identity());
  const Matrix15d before = filter.covariance();
  const KnownSight behind{{0, 0, -1}, {320, 240}, Eigen::Matrix2d::Identity()};
  EXPECT_EQ(filter.Update(lens, {{behind}}).status().code(), absl::StatusCode::kInvalidArgument);
  const KnownSight noiseless{{0, 0, 2}, {320, 240}, Eigen::Matrix2d::Zero()};
  EXPECT_EQ(filter.Update(lens, {{noiseless}}).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(filter.covariance(), before);
}

/// Root mean square of the innovations [px] of M3's and of M1's filter on one motion: a camera that
/// goes round a thing a metre and a half away and looks at it, as one does.
std::pair<double, double> Innovations(double corner_sigma_px) {
  RandomWorld world(6);
  const CameraModel lens = TestCamera();
  const std::vector<Vector3d> corners = WallOfSquares();
  KollerMotion truth;
  truth.angular_velocity_rad_s = {0.1, 1.2, 0.0};
  truth.velocity_m_s = -truth.angular_velocity_rad_s.cross(Vector3d(0.0, 0.0, 1.5));
  // Half the way lies before the wall's middle.
  truth = PropagateKoller(truth, -0.5);
  LandmarkFilter koller;
  koller.Reset(ToCameraMotion(truth).world_from_camera, 1e-4 * Matrix6d::Identity());
  FilterOptions options;
  options.fej_updates = 0;
  FilterState agile(options);
  Matrix12d p = 1e-4 * Matrix12d::Identity();
  p.bottomRightCorner<6, 6>() = Matrix6d::Identity();
  agile.Reset({ToCameraMotion(truth).world_from_camera, Vector3d::Zero(), Vector3d::Zero(), {}}, p);
  constexpr double kFrame_s = 1.0 / 25.0;
  double m3 = 0, m1 = 0;
  int count = 0;
  for (int k = 0; k < 28; ++k) {
    truth = PropagateKoller(truth, kFrame_s);
    koller.Predict(kFrame_s, {});
    agile.Predict(kFrame_s, {});
    std::vector<KnownSight> seen;
    std::vector<Observation> observed;
    for (const Vector3d& corner : corners) {
      const auto real = PredictFixed(lens, ToCameraMotion(truth).world_from_camera, corner);
      const auto by_koller = koller.Predicted(lens, corner),
                 by_agile = agile.Predicted(lens, corner);
      if (!real || !by_koller || !by_agile || !lens.InImage(real->pixel)) continue;
      KnownSight sight{corner, real->pixel + world.NormalVector<2>(corner_sigma_px),
                       corner_sigma_px * corner_sigma_px * Eigen::Matrix2d::Identity()};
      if (k >= 10) {  // both know by then how it moves
        m3 += (sight.pixel - by_koller->at.pixel).squaredNorm();
        m1 += (sight.pixel - by_agile->at.pixel).squaredNorm();
        ++count;
      }
      Observation observation;
      observation.known_point = corner;
      observation.pixel = sight.pixel;
      observation.noise = sight.noise;
      observed.push_back(observation);
      seen.push_back(sight);
    }
    EXPECT_TRUE(koller.Update(lens, seen).ok());
    EXPECT_TRUE(agile.Update(lens, observed, agile.camera().world_from_camera).ok());
  }
  EXPECT_GT(count, 200);
  return {std::sqrt(m3 / count), std::sqrt(m1 / count)};
}

TEST(LandmarkFilter, InnovationsOnAConstantTwistAreSmallerThanM1s) {
  const auto [m3, m1] = Innovations(0.1);  // of a corner from four line fits
  std::cout << "innovations: M3 " << m3 << " px, M1 " << m1 << " px\n";
  EXPECT_LT(m3, 0.7 * m1);
}

}  // namespace
}  // namespace saccade::koller_motion_test
