// What encoder readings say of the camera's motion, and how surely.
#include "server/tracker/encoder_motion.hpp"

#include <gtest/gtest.h>

#include <random>

namespace saccade::encoder_motion_test {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
constexpr double kDt = 1.0 / 30.0;

MountModel LeveredMount() {
  MountOptions options;
  options.of(MountJoint::kPan).offset_m = {0.01, -0.06, 0.02};
  options.of(MountJoint::kElevation).offset_m = {0.005, 0.01, 0.04};
  options.of(MountJoint::kCyclotorsion).offset_m = {0.0, -0.005, 0.03};
  return MountModel(options);
}

Rigid3 Between(const MountModel& model, const Vector6& joints) {
  return model.MountFromCamera(ToAngles(joints.head<3>())).Inverse() *
         model.MountFromCamera(ToAngles(joints.tail<3>()));
}

TEST(EncoderMotion, CovarianceMatchesCentralDifferences) {
  const MountModel model = LeveredMount();
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> angle(-1.0, 1.0), turn(-0.003, 0.003);
  for (int k = 0; k < 200; ++k) {
    Vector6 joints;
    for (int j = 0; j < 3; ++j) {
      joints(j) = angle(random);
      joints(j + 3) = joints(j) + turn(random);  // slow: time stamps hardly matter
    }
    const HeadMotion head = EncoderMotion(model, ToAngles(joints.head<3>()),
                                          ToAngles(joints.tail<3>()), kDt, /*metric=*/true);
    const Rigid3 at = Between(model, joints);
    EXPECT_LT((head.camera_from_next.translation - at.translation).norm(), 1e-15);
    EXPECT_LT(RotationAngle(head.camera_from_next, at), 1e-12);
    constexpr double kStep = 1e-5;
    Eigen::Matrix<double, 6, 6> jacobian;
    for (int c = 0; c < 6; ++c) {
      const auto error = [&](double step) {
        const Rigid3 moved = Between(model, joints + step * Vector6::Unit(c));
        Vector6 e;
        e << moved.translation - at.translation,
            LogQuaternion(at.rotation.conjugate() * moved.rotation);
        return e;
      };
      jacobian.col(c) = (error(kStep) - error(-kStep)) / (2 * kStep);
    }
    const double sigma = model.options().encoder_sigma_rad;
    const Eigen::Matrix<double, 6, 6> expected = sigma * sigma * jacobian * jacobian.transpose();
    ASSERT_LT((head.covariance - expected).norm(), 2e-3 * expected.norm());
  }
}

TEST(EncoderMotion, TimeStampsMatterWhereTheHeadIsFast) {
  const MountModel model = LeveredMount();
  const HeadMotion slow = EncoderMotion(model, {}, {}, kDt, true);
  const HeadMotion fast = EncoderMotion(model, {}, {.pan_rad = 6.0 * kDt}, kDt, true);
  const double sigma = model.options().encoder_sigma_rad;
  EXPECT_NEAR(slow.covariance(4, 4), 2 * sigma * sigma, 1e-12);
  EXPECT_NEAR(fast.covariance(4, 4), 2 * (sigma * sigma + 9e-6), 1e-12);  // 0.5 ms of 6 rad/s
}

TEST(EncoderMotion, UnknownUnitLeavesThePathUncertain) {
  const MountModel model = LeveredMount();
  const HeadMotion metric = EncoderMotion(model, {}, {.pan_rad = 0.2}, kDt, true);
  const HeadMotion scaleless = EncoderMotion(model, {}, {.pan_rad = 0.2}, kDt, false);
  const Eigen::Vector3d path = metric.camera_from_next.translation;
  EXPECT_GT(path.norm(), 0.01);
  EXPECT_EQ(scaleless.camera_from_next.translation, Eigen::Vector3d::Zero());
  EXPECT_LT(RotationAngle(scaleless.camera_from_next, metric.camera_from_next), 1e-12);
  const Eigen::Matrix3d more = (scaleless.covariance - metric.covariance).topLeftCorner<3, 3>();
  EXPECT_LT((more - path * path.transpose()).norm(), 1e-12);
}

TEST(EncoderMotion, ASaccadeThatBeginsIsFasterThanItsMean) {
  // From rest with 50 rad/s^2 in frames of 1/30 s: in the middle of an exposure the rate is twice
  // the mean since the frame before.
  constexpr double kAcceleration = 50.0;
  const double mean = 0.5 * kAcceleration * kDt;
  EXPECT_DOUBLE_EQ(RateWhenExposed(mean, 0.0), kAcceleration * kDt);
  EXPECT_DOUBLE_EQ(RateWhenExposed(5.9, 5.9), 5.9) << "steady";
  EXPECT_DOUBLE_EQ(RateWhenExposed(3.0, 5.9), 3.0) << "landing: no faster than on the average";
}

}  // namespace
}  // namespace saccade::encoder_motion_test
