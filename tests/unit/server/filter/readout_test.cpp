// The read-out time of a rolling shutter, estimated along with everything else.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::readout_test {
namespace {

/// A camera that goes to and fro before points of nearly known range; its rows are read one by one.
class RollingShutter {
 public:
  RollingShutter() : world_(4), lens_(TestCamera()), filter_(Options()) {
    Vector12d sigma;
    sigma << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-6),
        Eigen::Vector3d::Constant(0.1), Eigen::Vector3d::Constant(0.1);
    CameraMotion motion;
    motion.velocity_m_s = {kSpeed_m_s, 0.0, 0.0};
    filter_.Reset(motion, sigma.cwiseAbs2().asDiagonal());
    const CloneId clone = filter_.AddClone();
    for (int k = 0; k < 40; ++k) {
      FeatureBirth birth;
      birth.id = static_cast<FeatureId>(k + 1);
      birth.bearing = *lens_.Unproject({world_.Uniform(60, 580), world_.Uniform(40, 440)});
      birth.inverse_range = world_.Uniform(0.3, 0.8);
      birth.inverse_range_sigma = 0.01;
      birth.bearing_covariance = 1e-8 * Eigen::Matrix3d::Identity();
      EXPECT_TRUE(filter_.AddFeature(clone, birth).ok());
      points_.emplace_back(birth.bearing / birth.inverse_range);
    }
  }

  static FilterOptions Options() {
    FilterOptions options;
    options.readout_sigma_s = 0.015;
    options.parallax_sigmas = 0.0;
    return options;
  }

  /// The next frame of a camera whose rows take `readout_s`.
  void Frame(double readout_s) {
    filter_.Predict(1.0 / 30.0, MotionNoise());
    const double phase = kRate_rad_s * ++frame_ / 30.0;
    const double speed_m_s = kSpeed_m_s * std::cos(phase);
    const Rigid3 truth{Eigen::Quaterniond::Identity(),
                       {kSpeed_m_s / kRate_rad_s * std::sin(phase), 0.0, 0.0}};
    std::vector<Observation> seen;
    for (const FeatureId id : filter_.FeatureIds()) {
      const Eigen::Vector3d point = truth.Inverse() * points_[id - 1];
      const auto pixel = lens_.Project(point);
      if (!pixel || !lens_.InImage(*pixel) || !filter_.Predicted(lens_, id)) continue;
      Observation observation;
      observation.id = id;
      const double late = pixel->y() / 480.0 - 0.5;
      observation.d_readout = {-late * speed_m_s * 517.0 / point.z(), 0.0};
      // As the tracker does: carried to mid-exposure by the time that is believed in now.
      observation.pixel = *pixel + (readout_s - filter_.readout_s()) * observation.d_readout +
                          world_.NormalVector<2>(0.3);
      observation.noise = 0.16 * Eigen::Matrix2d::Identity();
      seen.push_back(observation);
    }
    ASSERT_TRUE(filter_.Update(lens_, seen, truth).ok());
  }

  const FilterState& filter() const { return filter_; }

 private:
  static constexpr double kSpeed_m_s = 0.6, kRate_rad_s = 3.0;
  RandomWorld world_;
  CameraModel lens_;
  FilterState filter_;
  std::vector<Eigen::Vector3d> points_;
  int frame_ = 0;
};

TEST(ReadOut, IsFoundFromRowsThatMove) {
  RollingShutter scene;
  for (int k = 0; k < 15; ++k) scene.Frame(0.012);
  EXPECT_NEAR(scene.filter().readout_s(), 0.012, 0.003);
}

// `hall_imu`, start a moment later: one frame with 25 of 44 features found moved it by 60 ms, and
// the map after it was half as large again.
TEST(ReadOut, AFrameThatWouldMoveItFarDoesNot) {
  RollingShutter scene;
  for (int k = 0; k < 160; ++k) scene.Frame(0.012);
  const double before = scene.filter().readout_s();
  scene.Frame(-0.06);
  EXPECT_EQ(scene.filter().readout_s(), before);
  for (int k = 0; k < 5; ++k) scene.Frame(0.012);
  EXPECT_NE(scene.filter().readout_s(), before) << "it is still estimated";
  EXPECT_NEAR(scene.filter().readout_s(), 0.012, 0.003);
}

}  // namespace
}  // namespace saccade::readout_test
