#include "shared/geometry/rigid3.hpp"

#include <gtest/gtest.h>

namespace saccade::rigid3_test {
namespace {

const Rigid3 kA = {ExpQuaternion({0.3, -0.2, 1.1}), {1, 2, 3}};
const Rigid3 kB = {ExpQuaternion({-1.0, 0.4, 0.2}), {-0.5, 0.1, 2}};
const Rigid3 kC = {ExpQuaternion({0.1, 2.0, -0.7}), {4, -3, 0.2}};
const Eigen::Vector3d kPoint(0.7, -1.3, 2.2);

TEST(Rigid3, ProductAppliesTheRightFactorFirst) {
  EXPECT_LT(((kA * kB) * kPoint - kA * (kB * kPoint)).norm(), 1e-14);
}

TEST(Rigid3, ProductIsAssociative) {
  EXPECT_LT((((kA * kB) * kC) * kPoint - (kA * (kB * kC)) * kPoint).norm(), 1e-13);
}

TEST(Rigid3, InverseTakesAPointBack) {
  EXPECT_LT((kA.Inverse() * (kA * kPoint) - kPoint).norm(), 1e-14);
  EXPECT_LT((kA * kA.Inverse()).translation.norm(), 1e-14);
}

TEST(Rigid3, RotationAngleIsSymmetricAndIgnoresTranslation) {
  const Rigid3 turned = {kA.rotation * ExpQuaternion({0, 0.25, 0}), {9, 9, 9}};
  EXPECT_NEAR(RotationAngle(kA, turned), 0.25, 1e-12);
  EXPECT_NEAR(RotationAngle(turned, kA), 0.25, 1e-12);
}

}  // namespace
}  // namespace saccade::rigid3_test
