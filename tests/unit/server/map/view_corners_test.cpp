#include "server/map/view_corners.hpp"

#include <gtest/gtest.h>

#include <random>

#include "shared/geometry/so3.hpp"
#include "tests/unit/server/features/recording.hpp"

namespace saccade::view_corners_test {
namespace {

/// Two pictures of 100 places between 1 and 3 m away, each with a look of its own.
class ViewCornersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    second_pose_.translation = {0.15, 0.02, -0.03};
    second_pose_.rotation = ExpQuaternion(Eigen::Vector3d(0.02, -0.08, 0.05));
    std::mt19937_64 rng(3);
    std::uniform_real_distribution<double> unit(-1, 1);
    while (first_.bearings.size() < 100) {
      const double x = unit(rng), y = unit(rng), z = unit(rng);
      const Eigen::Vector3d point((2 + z) * Eigen::Vector3d(0.5 * x, 0.35 * y, 1.0));
      const auto a = camera_->Project(point);
      const auto b = camera_->Project(second_pose_.Inverse() * point);
      if (!a || !b || !camera_->InImage(*a) || !camera_->InImage(*b)) continue;
      Descriptor look;
      for (std::uint64_t& word : look) word = rng();
      Add(*a, look, first_);
      Add(*b, look, second_);
      points_.push_back(point);
    }
  }
  void Add(const Eigen::Vector2d& pixel, const Descriptor& look, ViewCorners& corners) {
    DescribedPoint place;
    place.pixel = pixel;
    place.descriptors[0] = look;
    place.present[0] = true;
    corners.described.push_back(place);
    corners.bearings.push_back(camera_->Unproject(pixel)->normalized());
    corners.ranges_m.push_back(0.0);
  }
  int Triangulate() {
    return TriangulateCorners(*camera_, {Rigid3(), &first_}, {second_pose_, &second_}, 0.3, 6.0);
  }

  const std::shared_ptr<const CameraModel> camera_ = TumCamera();
  Rigid3 second_pose_;
  ViewCorners first_, second_;
  std::vector<Eigen::Vector3d> points_;
};

TEST_F(ViewCornersTest, RangesAreFound) {
  EXPECT_GE(Triangulate(), 95);  // few are too near to a place that shares their line
  int known = 0;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    if (first_.ranges_m[k] <= 0) continue;
    ++known;
    EXPECT_NEAR(first_.ranges_m[k], points_[k].norm(), 1e-3);
    EXPECT_NEAR(second_.ranges_m[k], (points_[k] - second_pose_.translation).norm(), 1e-3);
  }
  EXPECT_GE(known, 95);
}

TEST_F(ViewCornersTest, TwoThatLookAlikeOnOneLineAreLeftOut) {
  // Far along the epipolar line of place 0: what it would show from another range.
  const Eigen::Vector3d other = 0.6 * points_[0];
  const auto pixel = camera_->Project(second_pose_.Inverse() * other);
  ASSERT_TRUE(pixel.has_value());
  Add(*pixel, second_.described[0].descriptors[0], second_);
  Triangulate();
  EXPECT_EQ(first_.ranges_m[0], 0.0);
  EXPECT_GT(first_.ranges_m[1] + first_.ranges_m[2], 0.0);
}

TEST_F(ViewCornersTest, WhatMissesItsLineIsLeftOut) {
  const Eigen::Vector2d moved = second_.described[0].pixel + Eigen::Vector2d(0, 12);
  second_.described[0].pixel = moved;
  second_.bearings[0] = camera_->Unproject(moved)->normalized();
  Triangulate();
  EXPECT_EQ(first_.ranges_m[0], 0.0);
}

TEST_F(ViewCornersTest, WithoutParallaxNothingIsKnown) {
  second_pose_.translation *= 0.01;
  EXPECT_EQ(Triangulate(), 0);
}

}  // namespace
}  // namespace saccade::view_corners_test
