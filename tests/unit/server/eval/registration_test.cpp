#include "server/eval/registration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace saccade::registration_test {
namespace {

CameraModel Camera() {
  CameraIntrinsics c;
  c.width = 640;
  c.height = 480;
  c.fx = c.fy = 500;
  c.cx = 320;
  c.cy = 240;
  return CameraModel(c);
}
const Eigen::Vector3d kPoint(0, 0, 2);

TEST(Registration, SameMistakeInPoseAndAnchorCancelsInThePicture) {
  const Rigid3 shift = {ExpQuaternion({0, 0.3, 0}), {1, 2, 3}};
  const auto error = CompareRegistration(Camera(), {}, kPoint, shift, shift * kPoint);
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->pixels, 0, 1e-9);
  EXPECT_NEAR(*error->mm_per_m, 0, 1e-9);
}

TEST(Registration, AnOffsetIsMeasuredInPixelsAndMillimetresPerMetre) {
  const auto error = CompareRegistration(Camera(), {}, kPoint, {}, Eigen::Vector3d(0.01, 0, 2));
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->pixels, 2.5, 1e-9);
  EXPECT_NEAR(*error->mm_per_m, 5.0, 1e-9);
}

TEST(Registration, NotDrawnCountsFiftyPixels) {
  const auto hidden = CompareRegistration(Camera(), {}, kPoint, {}, std::nullopt);
  ASSERT_TRUE(hidden);
  EXPECT_EQ(hidden->pixels, 50.0);
  EXPECT_FALSE(hidden->mm_per_m);
  const auto behind = CompareRegistration(Camera(), {}, kPoint, {}, Eigen::Vector3d(0, 0, -2));
  ASSERT_TRUE(behind);
  EXPECT_EQ(behind->pixels, 50.0);
}

TEST(Registration, TenCentimetresOrFiveDegreesAreLost) {
  EXPECT_FALSE(IsLost({Eigen::Quaterniond::Identity(), {0.099, 0, 0}}, {}));
  EXPECT_TRUE(IsLost({Eigen::Quaterniond::Identity(), {0.101, 0, 0}}, {}));
  const double degree = std::numbers::pi / 180;
  EXPECT_FALSE(IsLost({ExpQuaternion({0, 4.9 * degree, 0}), {0, 0, 0}}, {}));
  EXPECT_TRUE(IsLost({ExpQuaternion({0, 5.1 * degree, 0}), {0, 0, 0}}, {}));
  const double nan = std::nan("");
  EXPECT_TRUE(IsLost({Eigen::Quaterniond::Identity(), {nan, 0, 0}}, {}));
}

}  // namespace
}  // namespace saccade::registration_test
