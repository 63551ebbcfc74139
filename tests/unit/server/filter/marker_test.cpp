// Markers as poses of the state (slam-spec 7).
#include <gtest/gtest.h>

#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::marker_test {
namespace {

using Eigen::Vector3d;

const std::vector<Vector3d> kCorners = {
    {-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.1, 0.1, 0}, {-0.1, 0.1, 0}};

FilterState Filter(double camera_variance) {
  FilterOptions options;
  options.fej_updates = 0;
  options.parallax_sigmas = 0.0;
  FilterState filter(options);
  filter.Reset(CameraMotion(), camera_variance * Matrix12d::Identity());
  return filter;
}

std::vector<Observation> See(const CameraModel& lens, const Rigid3& camera, const Rigid3& marker,
                             CloneId id, double sigma_px) {
  std::vector<Observation> seen;
  for (const Vector3d& corner : kCorners) {
    Observation observation;
    observation.known_point = corner;
    observation.marker = id;
    observation.pixel = PredictFixed(lens, camera, marker * corner)->pixel;
    observation.noise = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
    seen.push_back(observation);
  }
  return seen;
}

/// A marker half aslant before a camera at the origin.
Rigid3 RandomMarker(RandomWorld& world) {
  const Vector3d tilt(world.Uniform(-0.6, 0.6), world.Uniform(-0.6, 0.6), world.Uniform(-3, 3));
  return {ExpQuaternion(Vector3d(M_PI, 0, 0)) * ExpQuaternion(tilt),
          Vector3d(world.Uniform(-0.2, 0.2), world.Uniform(-0.2, 0.2), world.Uniform(0.6, 1.5))};
}

TEST(Marker, OneUpdateGoesAllTheWayForASmallStepT1) {
  RandomWorld world(1);
  const CameraModel lens = TestCamera();
  for (int k = 0; k < 200; ++k) {
    FilterState filter = Filter(0.0);
    const Rigid3 guess = RandomMarker(world);
    const Eigen::Matrix<double, 6, 1> step = world.NormalVector<6>(1e-4);
    const CloneId id = filter.AddMarker(guess, Matrix6d::Identity());
    const auto seen = See(lens, Rigid3(), PlusPose(guess, step), id, 1e-4);
    ASSERT_TRUE(filter.Update(lens, seen, Rigid3()).ok());
    const Rigid3 found = *filter.ClonePose(id);
    // A wrong column of H would leave a part of the step.
    EXPECT_LT((found.translation - PlusPose(guess, step).translation).norm(), 2e-6);
    EXPECT_LT(RotationAngle(found, PlusPose(guess, step)), 2e-5);
  }
}

TEST(Marker, MovesTheCameraInItsStead) {
  RandomWorld world(2);
  const CameraModel lens = TestCamera();
  for (int k = 0; k < 100; ++k) {
    FilterState filter = Filter(1.0);
    const Rigid3 marker = RandomMarker(world);
    const CloneId id = filter.AddMarker(marker, Matrix6d::Zero());
    const Rigid3 camera = PlusPose(Rigid3(), world.NormalVector<6>(1e-4));
    ASSERT_TRUE(filter.Update(lens, See(lens, camera, marker, id, 1e-4), Rigid3()).ok());
    EXPECT_LT((filter.camera().world_from_camera.translation - camera.translation).norm(), 2e-6);
    EXPECT_LT(RotationAngle(filter.camera().world_from_camera, camera), 2e-5);
  }
}

TEST(Marker, SeenAgainTiesTheCameraToWhereItWas) {
  RandomWorld world(3);
  const CameraModel lens = TestCamera();
  FilterState filter = Filter(1e-8);
  const Rigid3 marker = RandomMarker(world);
  const CloneId id =
      filter.AddMarker(PlusPose(marker, world.NormalVector<6>(0.02)), 0.01 * Matrix6d::Identity());
  for (int k = 0; k < 5; ++k) {
    const Rigid3 at = filter.camera().world_from_camera;
    ASSERT_TRUE(filter.Update(lens, See(lens, Rigid3(), marker, id, 0.3), at).ok());
  }
  // A second of walking blind, and then one look at the marker.
  filter.Predict(1.0, MotionNoise());
  const double blind = filter.PoseCovariance().topLeftCorner<3, 3>().trace();
  const Rigid3 camera{ExpQuaternion(Vector3d(0.01, 0.02, 0)), {0.05, -0.02, 0.03}};
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(filter.Update(lens, See(lens, camera, marker, id, 0.3), camera).ok());
  }
  const double after = filter.PoseCovariance().topLeftCorner<3, 3>().trace();
  EXPECT_LT(after, 0.05 * blind);
  EXPECT_LT((filter.camera().world_from_camera.translation - camera.translation).norm(), 0.03);
  const Eigen::MatrixXd p = filter.FullCovariance();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
      p.selfadjointView<Eigen::Lower>() * Eigen::MatrixXd::Identity(p.rows(), p.cols()));
  EXPECT_GT(solver.eigenvalues().minCoeff(), -1e-10 * p.trace());
}

TEST(Marker, StaysWhenFeaturesLeaveAndIsGoneWithTheMap) {
  FilterState filter = Filter(1e-4);
  const CloneId marker = filter.AddMarker(Rigid3(), Matrix6d::Identity());
  const CloneId clone = filter.AddClone();
  FeatureBirth birth;
  birth.id = 1;
  ASSERT_TRUE(filter.AddFeature(clone, birth).ok());
  filter.Remove(std::vector<FeatureId>{1});
  EXPECT_FALSE(filter.ClonePose(clone));
  EXPECT_TRUE(filter.ClonePose(marker));
  filter.Reset(CameraMotion(), Matrix12d::Identity());
  EXPECT_FALSE(filter.ClonePose(marker));
}

TEST(Marker, ThatIsUnknownIsRefused) {
  FilterState filter = Filter(1e-4);
  const CameraModel lens = TestCamera();
  const auto seen = See(lens, Rigid3(), {ExpQuaternion({M_PI, 0, 0}), {0, 0, 1}}, 77, 0.3);
  EXPECT_EQ(filter.Update(lens, seen, Rigid3()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace saccade::marker_test
