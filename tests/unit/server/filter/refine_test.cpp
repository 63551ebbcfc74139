#include <gtest/gtest.h>

#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::refine_test {
namespace {

/// A filter with 12 features, and what it does for some frames: the same for every copy.
class Scene {
 public:
  Scene() : world_(3), lens_(TestCamera()), filter_(Options()) {
    Vector12d sigma;
    sigma << Eigen::Vector3d::Constant(0.01), Eigen::Vector3d::Constant(0.01),
        Eigen::Vector3d::Constant(0.3), Eigen::Vector3d::Constant(0.3);
    // As it moves in Frame(): hardly any innovation, so that the update is linear.
    CameraMotion motion;
    motion.velocity_m_s = {0.3, 0.06, 0.0};
    motion.angular_velocity_rad_s = {0.0, 0.06, 0.03};
    filter_.Reset(motion, sigma.cwiseAbs2().asDiagonal());
    Born(12);
    for (int k = 1; k < 5; ++k) Frame(filter_, k);
  }

  static FilterOptions Options() {
    FilterOptions options;
    options.readout_sigma_s = 0.01;
    options.parallax_sigmas = 0.0;
    options.fej_updates = 0;
    return options;
  }

  void Born(int count) {
    const CloneId clone = filter_.AddClone();
    for (int k = 0; k < count; ++k) {
      FeatureBirth birth;
      birth.id = ++newest_;
      const Eigen::Vector2d pixel(80.0 + 40.0 * k, 90.0 + 83.0 * (k % 4));
      birth.bearing = *lens_.Unproject(pixel);
      birth.inverse_range = 0.5;
      birth.inverse_range_sigma = 0.1;
      birth.bearing_covariance = 1e-6 * Eigen::Matrix3d::Identity();
      ASSERT_TRUE(filter_.AddFeature(clone, birth).ok());
      points_.push_back(filter_.camera().world_from_camera * (birth.bearing / 0.5));
    }
  }

  void Frame(FilterState& filter, int k) {
    filter.Predict(1.0 / 30.0, MotionNoise());
    const Rigid3 truth{ExpQuaternion({0.0, 0.002 * k, 0.001 * k}), {0.01 * k, 0.002 * k, 0.0}};
    std::vector<Observation> seen;
    for (const FeatureId id : filter.FeatureIds()) {
      if (id > points_.size()) continue;
      const auto pixel = lens_.Project(truth.Inverse() * points_[id - 1]);
      if (!pixel || !lens_.InImage(*pixel) || !filter.Predicted(lens_, id)) continue;
      Observation observation;
      observation.id = id;
      observation.pixel = *pixel;
      observation.d_readout = {3.0, 1.0};
      seen.push_back(observation);
    }
    ASSERT_TRUE(filter.Update(lens_, seen, filter.camera().world_from_camera).ok());
  }

  /// Frames, a feature removed, a range told, a clone with a new feature: everything a journal must
  /// carry.
  void GoOn(FilterState& filter) {
    for (int k = 5; k < 8; ++k) Frame(filter, k);
    const FeatureId gone[] = {4};
    filter.Remove(gone);
    filter.TellRange(5, 0.5, 0.05);
    const CloneId clone = filter.AddClone();
    FeatureBirth birth;
    birth.id = newest_ + 1;
    birth.inverse_range = 0.7;
    ASSERT_TRUE(filter.AddFeature(clone, birth).ok());
    for (int k = 8; k < 10; ++k) Frame(filter, k);
  }

  /// The estimates moved by a little of everything.
  Refinement Better(const FilterState& filter, double size) {
    RandomWorld random(9);
    Refinement better;
    const auto moved = [&](const Rigid3& pose) {
      return Rigid3{pose.rotation * ExpQuaternion(random.NormalVector<3>(0.01 * size)),
                    pose.translation + random.NormalVector<3>(0.01 * size)};
    };
    better.world_from_camera = moved(filter.camera().world_from_camera);
    const CloneId clone = filter.CloneOf(1);
    better.clones[clone] = moved(*filter.ClonePose(clone));
    for (const FeatureId id : filter.FeatureIds()) {
      const PointFromClone point = filter.Point(id);
      better.features[id] = {(point.bearing + random.NormalVector<3>(0.001 * size)).normalized(),
                             point.inverse_range * (1.0 + random.Normal(0.03 * size))};
    }
    return better;
  }

  FilterState& filter() { return filter_; }

 private:
  RandomWorld world_;
  CameraModel lens_;
  FilterState filter_;
  std::vector<Eigen::Vector3d> points_;
  FeatureId newest_ = 0;
};

double Distance(const FilterState& a, const FilterState& b) {
  double sum = Minus(a.camera(), b.camera()).squaredNorm();
  for (const FeatureId id : a.FeatureIds()) {
    sum += (a.Marginal(id).point_in_world - b.Marginal(id).point_in_world).squaredNorm();
  }
  return std::sqrt(sum);
}

/// Late is as good as at once: the second order of the correction is all that differs.
TEST(Refine, LateEqualsAtOnce) {
  double ratio[2];
  for (const int k : {0, 1}) {
    const double size = k == 0 ? 0.02 : 0.004;
    Scene scene;
    const Refinement better = scene.Better(scene.filter(), size);
    FilterState plain = scene.filter(), at_once = scene.filter(), late = scene.filter();
    scene.GoOn(plain);
    at_once.SetCheckpoint();
    at_once.Refine(better);
    scene.GoOn(at_once);
    late.SetCheckpoint();
    scene.GoOn(late);
    late.Refine(better);
    const double effect = Distance(plain, at_once);
    ASSERT_GT(effect, 1e-5 * size);
    ratio[k] = Distance(late, at_once) / effect;
  }
  EXPECT_LT(ratio[0], 0.1);
  EXPECT_LT(ratio[1], 0.4 * ratio[0]) << "the difference is not of second order";
}

TEST(Refine, PutsTheEstimatesWhereTheyAreSaidToBe) {
  Scene scene;
  const Refinement better = scene.Better(scene.filter(), 1.0);
  FilterState& filter = scene.filter();
  const double trace = filter.FullCovariance().trace();
  filter.SetCheckpoint();
  filter.Refine(better);
  EXPECT_LT(RotationAngle(filter.camera().world_from_camera, *better.world_from_camera), 1e-9);
  for (const auto& [id, feature] : better.features) {
    EXPECT_LT((filter.Point(id).bearing - feature.bearing).norm(), 1e-9);
    EXPECT_NEAR(filter.Point(id).inverse_range, feature.inverse_range, 1e-12);
  }
  EXPECT_NEAR(filter.FullCovariance().trace() / trace, 1.0, 0.05);
}

TEST(Refine, WithoutAMarkNothingMoves) {
  Scene scene;
  const Refinement better = scene.Better(scene.filter(), 1.0);
  const FilterState before = scene.filter();
  scene.filter().Refine(better);
  EXPECT_LT(Distance(before, scene.filter()), 1e-12);
  scene.filter().SetCheckpoint();
  scene.filter().DropCheckpoint();
  scene.filter().Refine(better);
  EXPECT_LT(Distance(before, scene.filter()), 1e-12);
}

}  // namespace
}  // namespace saccade::refine_test
