#include "server/mount/mount_model.hpp"

#include <gtest/gtest.h>

#include <random>

namespace saccade::mount_model_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Offsets of some centimetres and axes that are up to 2 deg off, as calibration may find them.
MountOptions CrookedMount() {
  MountOptions options;
  options.of(MountJoint::kPan).offset_m = {0.01, -0.06, 0.02};
  options.of(MountJoint::kElevation).offset_m = {0.0, -0.03, 0.04};
  options.of(MountJoint::kCyclotorsion).offset_m = {0.005, 0.0, 0.03};
  options.of(MountJoint::kPan).axis = Eigen::Vector3d(0.02, 1, -0.03).normalized();
  options.of(MountJoint::kElevation).axis = Eigen::Vector3d(1, 0.01, 0.02).normalized();
  options.of(MountJoint::kCyclotorsion).axis = Eigen::Vector3d(-0.03, 0.02, 1).normalized();
  return options;
}

MountAngles RandomAngles(std::mt19937_64& rng) {
  std::uniform_real_distribution<double> wide(-2.8, 2.8), tall(-1.2, 1.2), roll(-0.7, 0.7);
  return {wide(rng), tall(rng), roll(rng)};
}

TEST(MountModel, DefaultOrderIsPanElevationTorsion) {
  const MountModel model;
  const MountAngles angles{0.5, -0.3, 0.2};
  const Eigen::Quaterniond expected =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY())) *
      Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitX()) *
      Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ());
  const Rigid3 pose = model.MountFromCamera(angles);
  EXPECT_LT(pose.rotation.angularDistance(expected), 1e-12);
  EXPECT_EQ(pose.translation.norm(), 0.0);
  // Positive pan looks to the right (x), positive elevation up (-y).
  EXPECT_GT((model.MountFromCamera({0.1, 0, 0}).rotation * Eigen::Vector3d::UnitZ()).x(), 0);
  EXPECT_LT((model.MountFromCamera({0, 0.1, 0}).rotation * Eigen::Vector3d::UnitZ()).y(), 0);
}

TEST(MountModel, JacobianMatchesCentralDifferencesInEveryOrder) {
  std::mt19937_64 rng(5);
  MountOptions options = CrookedMount();
  using enum MountJoint;
  for (const auto& order :
       {std::array{kPan, kElevation, kCyclotorsion}, std::array{kElevation, kPan, kCyclotorsion},
        std::array{kCyclotorsion, kPan, kElevation}}) {
    options.order = order;
    const MountModel model(options);
    for (int trial = 0; trial < 100; ++trial) {
      const MountAngles at = RandomAngles(rng);
      const Rigid3 pose = model.MountFromCamera(at);
      Eigen::Matrix<double, 6, 3> numeric;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Unit(k);
        const Rigid3 plus = model.MountFromCamera(ToAngles(ToVector(at) + step));
        const Rigid3 minus = model.MountFromCamera(ToAngles(ToVector(at) - step));
        numeric.col(k).head<3>() = (plus.translation - minus.translation) / 2e-6;
        numeric.col(k).tail<3>() = (LogQuaternion(pose.rotation.conjugate() * plus.rotation) -
                                    LogQuaternion(pose.rotation.conjugate() * minus.rotation)) /
                                   2e-6;
      }
      EXPECT_LT((model.Jacobian(at) - numeric).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

TEST(MountModel, FixationPutsThePointOnTheOpticAxisAndLevelsTheCamera) {
  std::mt19937_64 rng(7);
  std::normal_distribution<double> normal;
  for (const MountOptions& options : {MountOptions(), CrookedMount()}) {
    const MountModel model(options);
    int reached = 0;
    for (int trial = 0; trial < 300; ++trial) {
      Eigen::Vector3d point(normal(rng), 0.6 * normal(rng), normal(rng));
      point *= (0.7 + 2.0 * std::abs(normal(rng))) / point.norm();
      const Eigen::Vector3d down(0.1 * normal(rng), 1, 0.1 * normal(rng));
      const FixationAngles fixation = model.Fixate(point, down, {0.2, 0.1, 0});
      EXPECT_TRUE(model.WithinLimits(fixation.angles));
      if (!fixation.reachable) continue;
      ++reached;
      const Rigid3 camera_from_mount = model.MountFromCamera(fixation.angles).Inverse();
      const Eigen::Vector3d seen = camera_from_mount * point;
      EXPECT_LT(seen.head<2>().norm() / seen.z(), 1e-4);
      const Eigen::Vector3d down_in_camera = camera_from_mount.rotation * down.normalized();
      if (std::abs(fixation.angles.cyclotorsion_rad) < 49 * kDegree) {
        EXPECT_NEAR(down_in_camera.x(), 0, 1e-3);
        EXPECT_GT(down_in_camera.y(), 0);
      }
    }
    EXPECT_GT(reached, 270);
  }
}

TEST(MountModel, FixationBehindTheBackTakesTheNearerTurn) {
  const MountModel model;
  // 190 deg to the right is within the limits and nearer to where the head is than 170 to the left.
  const Eigen::Vector3d point =
      Eigen::Vector3d(std::sin(190 * kDegree), 0, std::cos(190 * kDegree));
  EXPECT_NEAR(model.Fixate(point, std::nullopt, {170 * kDegree, 0, 0}).angles.pan_rad,
              190 * kDegree, 1e-9);
  EXPECT_NEAR(model.Fixate(point, std::nullopt, {-100 * kDegree, 0, 0}).angles.pan_rad,
              -170 * kDegree, 1e-9);
}

TEST(MountModel, UnwindsWhereBothWaysAreAboutAsLong) {
  const MountModel model;
  const auto pan_from = [&](double now_deg, double target_deg) {
    const double target = target_deg * kDegree;
    return model
               .Fixate({std::sin(target), 0, std::cos(target)}, std::nullopt,
                       {now_deg * kDegree, 0, 0})
               .angles.pan_rad /
           kDegree;
  };
  EXPECT_NEAR(pan_from(200, 10), 10, 1e-6) << "not 370, which is out of reach, nor 170 further";
  EXPECT_NEAR(pan_from(170, -20), -20, 1e-6) << "190 deg back rather than 170 deg on to 340";
  EXPECT_NEAR(pan_from(150, -120), 240, 1e-6) << "90 deg on rather than 270 deg back";
  EXPECT_NEAR(pan_from(240, -115), 245, 1e-6) << "what is held is held on";
}

TEST(MountModel, OutOfReachLooksAtTheNearestReachableDirection) {
  MountOptions options;
  options.of(MountJoint::kPan).min_rad = -60 * kDegree;
  options.of(MountJoint::kPan).max_rad = 60 * kDegree;
  options.of(MountJoint::kElevation).max_rad = 40 * kDegree;
  options.of(MountJoint::kElevation).min_rad = -30 * kDegree;
  const MountModel model(options);
  std::mt19937_64 rng(11);
  std::normal_distribution<double> normal;
  int unreachable = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3d point(normal(rng), normal(rng), normal(rng));
    const FixationAngles fixation = model.Fixate(point, std::nullopt, {});
    EXPECT_TRUE(model.WithinLimits(fixation.angles));
    unreachable += !fixation.reachable;
    double best = 10;  // over all that can be reached, by search
    for (double a = -60; a <= 60; a += 1) {
      for (double e = -30; e <= 40; e += 1) {
        best = std::min(best, model.Miss({a * kDegree, e * kDegree, 0}, point));
      }
    }
    EXPECT_LE(fixation.miss_rad, best + 1e-6);
  }
  EXPECT_GT(unreachable, 80);
}

TEST(MountModel, StraightUpHasNoPanOfItsOwn) {
  MountOptions options;
  options.of(MountJoint::kElevation).max_rad = 95 * kDegree;
  const MountModel model(options);
  const FixationAngles up = model.Fixate({0, -1, 0}, Eigen::Vector3d(0, 1, 0), {0.7, 1.2, 0});
  EXPECT_TRUE(up.reachable);
  EXPECT_NEAR(up.angles.pan_rad, 0.7, 1e-6);
}

}  // namespace
}  // namespace saccade::mount_model_test
