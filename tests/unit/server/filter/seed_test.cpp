#include <gtest/gtest.h>

#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::seed_test {
namespace {

/// Two clones with three features, and some covariance.
MapSeed TwoClones() {
  MapSeed seed;
  seed.clones = {{Eigen::Quaterniond::Identity(), {0.0, 0.0, 0.0}},
                 {ExpQuaternion({0.0, 0.1, 0.0}), {0.2, 0.0, 0.1}}};
  for (int k = 0; k < 3; ++k) {
    MapSeed::Feature feature;
    feature.id = 5 + static_cast<FeatureId>(k);
    feature.clone = k == 2 ? 1 : 0;
    feature.bearing = Eigen::Vector3d(0.1 * k, -0.05 * k, 1.0).normalized();
    feature.birth_covariance = 1e-6 * Eigen::Matrix2d::Identity();
    feature.inverse_range = 0.4 + 0.1 * k;
    seed.features.push_back(feature);
  }
  seed.readout_s = 0.012;
  const Eigen::Index size = 1 + 6 * 2 + 3 * 3;
  Eigen::MatrixXd root(size, size);
  for (Eigen::Index r = 0; r < size; ++r) {
    for (Eigen::Index c = 0; c < size; ++c) root(r, c) = 1e-3 * std::sin(1.0 + 3.0 * r + 7.0 * c);
  }
  seed.covariance = root * root.transpose();
  return seed;
}

FilterOptions Rolling() {
  FilterOptions options;
  options.readout_sigma_s = 0.01;
  return options;
}

TEST(Seed, TheFilterIsWhatItIsGiven) {
  FilterState filter(Rolling());
  const MapSeed seed = TwoClones();
  CameraMotion camera;
  camera.world_from_camera.translation = {0.3, 0.0, 0.1};
  const Matrix12d wide = 1e-2 * Matrix12d::Identity();
  const std::vector<CloneId> clones = filter.Seed(seed, camera, wide);
  ASSERT_EQ(clones.size(), 2u);
  EXPECT_EQ(filter.dim(), 12 + 1 + 12 + 9);
  EXPECT_EQ(filter.readout_s(), 0.012);
  EXPECT_EQ(filter.camera().world_from_camera.translation, camera.world_from_camera.translation);
  const Eigen::MatrixXd full = filter.FullCovariance();
  EXPECT_EQ(full.topLeftCorner(12, 12), wide);
  EXPECT_TRUE(full.block(12, 0, 22, 12).isZero(0.0)) << "the camera shares nothing with the map";
  EXPECT_TRUE(full.bottomRightCorner(22, 22).isApprox(seed.covariance, 1e-12));
  for (const MapSeed::Feature& feature : seed.features) {
    ASSERT_TRUE(filter.Has(feature.id));
    EXPECT_EQ(filter.CloneOf(feature.id), clones[static_cast<std::size_t>(feature.clone)]);
    EXPECT_EQ(filter.Point(feature.id).bearing, feature.bearing);
    EXPECT_EQ(filter.Point(feature.id).inverse_range, feature.inverse_range);
  }
  EXPECT_EQ(filter.ClonePose(clones[1])->translation, seed.clones[1].translation);
}

TEST(Seed, WithFrozenBearingsOnlyTheRangesAreTaken) {
  FilterOptions options = Rolling();
  options.form = PointForm::kRangeOnly;
  FilterState filter(options);
  const MapSeed seed = TwoClones();
  filter.Seed(seed, CameraMotion(), Matrix12d::Identity());
  EXPECT_EQ(filter.dim(), 12 + 1 + 12 + 3);
  EXPECT_EQ(filter.FullCovariance()(25, 25), seed.covariance(15, 15));
  EXPECT_EQ(filter.FullCovariance()(27, 26), seed.covariance(21, 18));
}

TEST(Seed, GoesOnLikeAnyOther) {
  FilterState filter(Rolling());
  filter.Seed(TwoClones(), CameraMotion(), 1e-3 * Matrix12d::Identity());
  const CameraModel lens = TestCamera();
  MotionNoise noise{1.0, 1.0};
  filter.Predict(1.0 / 30.0, noise);
  std::vector<Observation> observations;
  for (const FeatureId id : filter.FeatureIds()) {
    const auto predicted = filter.Predicted(lens, id);
    ASSERT_TRUE(predicted.has_value());
    Observation observation;
    observation.id = id;
    observation.pixel = predicted->at.pixel + Eigen::Vector2d(1.0, 0.0);
    observations.push_back(observation);
  }
  const double before = filter.PoseCovariance().trace();
  ASSERT_TRUE(filter.Update(lens, observations, filter.camera().world_from_camera).ok());
  EXPECT_LT(filter.PoseCovariance().trace(), before);
  const std::vector<FeatureId> gone = {5, 6};
  filter.Remove(gone);
  EXPECT_EQ(filter.clone_count(), 1u);
}

}  // namespace
}  // namespace saccade::seed_test
