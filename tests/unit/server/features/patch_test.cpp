#include "server/features/patch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "shared/geometry/so3.hpp"
#include "tests/unit/server/features/recording.hpp"
#include "tests/unit/server/features/textured_plane.hpp"

namespace saccade::patch_test {
namespace {

class PatchTest : public ::testing::Test {
 protected:
  PatchTest() : camera_(DeskCamera()) {
    const Rigid3 pose{Eigen::Quaterniond::Identity(), {0, 0, -1}};
    image_ = TexturedPlane(6, 4.0 / 195).Render(*camera_, pose);
    patch_ = *CutPatch(image_, {161.3, 124.6}, camera_);
  }
  WarpStatus Warp(const Rigid3& current_from_birth, double inverse_depth,
                  const Eigen::Vector3d& normal = Eigen::Vector3d::Zero()) {
    Eigen::Vector3d point = current_from_birth.rotation * patch_.birth_bearing +
                            inverse_depth * current_from_birth.translation;
    const auto pixel = camera_->Project(point);
    return WarpPatch(patch_, current_from_birth, patch_.birth_bearing, inverse_depth, normal,
                     *camera_, pixel.value_or(Eigen::Vector2d(160, 120)), {}, warped_);
  }
  std::shared_ptr<const CameraModel> camera_;
  cv::Mat image_;
  PatchTemplate patch_;
  WarpedPatch warped_;
};

TEST_F(PatchTest, FromTheBirthPoseItIsTheTemplateItself) {
  WarpedPatch copy;
  ASSERT_EQ(CopyPatch(patch_, {}, copy), WarpStatus::kOk);
  for (const double inverse_depth : {0.0, 0.5, 2.0}) {
    ASSERT_EQ(Warp(Rigid3{}, inverse_depth), WarpStatus::kOk);
    EXPECT_EQ(warped_.fine.size, 11);
    EXPECT_EQ(warped_.coarse.size, 9);
    for (int k = 0; k < 11 * CorrelationTemplate::kStride; ++k) {
      EXPECT_NEAR(warped_.fine.pixels[k], copy.fine.pixels[k], 1) << k;
    }
    EXPECT_NEAR(warped_.scale, 1.0, 0.01);
    EXPECT_NEAR(warped_.view_angle_rad, 0.0, 1e-6);
  }
}

TEST_F(PatchTest, ScaleFollowsTheDistanceAndIsLimited) {
  ASSERT_EQ(Warp({Eigen::Quaterniond::Identity(), {0, 0, -0.4}}, 1.0), WarpStatus::kOk);
  EXPECT_NEAR(warped_.scale, 1.0 / 0.6, 0.02);
  ASSERT_EQ(Warp({Eigen::Quaterniond::Identity(), {0, 0, 0.8}}, 1.0), WarpStatus::kOk);
  EXPECT_NEAR(warped_.scale, 1.0 / 1.8, 0.02);
  EXPECT_EQ(Warp({Eigen::Quaterniond::Identity(), {0, 0, -0.6}}, 1.0), WarpStatus::kScale);
  EXPECT_EQ(Warp({Eigen::Quaterniond::Identity(), {0, 0, 1.2}}, 1.0), WarpStatus::kScale);
}

TEST_F(PatchTest, RefusesWhatCannotBeSeen) {
  EXPECT_EQ(Warp({Eigen::Quaterniond::Identity(), {0, 0, -2.0}}, 1.0), WarpStatus::kNotInView);
  // Round the point by 70 degrees.
  const Eigen::Quaterniond turn = ExpQuaternion({0, 1.22, 0});
  const Eigen::Vector3d point = patch_.birth_bearing;
  EXPECT_EQ(Warp({turn, point - turn * point}, 1.0), WarpStatus::kTooOblique);
  EXPECT_EQ(Warp(Rigid3{}, 1.0, Eigen::Vector3d(0.99, 0, -0.14)), WarpStatus::kTooOblique);
  EXPECT_EQ(Warp(Rigid3{}, 1.0, Eigen::Vector3d(0, 0, 1)), WarpStatus::kNotInView);  // its back
}

TEST_F(PatchTest, RefusesBadNumbersAndLowTexture) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Warp(Rigid3{}, nan), WarpStatus::kBadInput);
  EXPECT_EQ(Warp(Rigid3{}, -0.1), WarpStatus::kBadInput);
  EXPECT_EQ(Warp(Rigid3{}, std::numeric_limits<double>::infinity()), WarpStatus::kBadInput);
  EXPECT_EQ(Warp({Eigen::Quaterniond::Identity(), {nan, 0, 0}}, 1.0), WarpStatus::kBadInput);
  EXPECT_EQ(Warp(Rigid3{}, 1.0, Eigen::Vector3d(nan, 0, 0)), WarpStatus::kBadInput);
  EXPECT_EQ(WarpPatch(patch_, Rigid3{}, patch_.birth_bearing, 1.0, Eigen::Vector3d::Zero(),
                      *camera_, {nan, 3}, {}, warped_),
            WarpStatus::kBadInput);
  patch_.camera = nullptr;
  EXPECT_EQ(Warp(Rigid3{}, 1.0), WarpStatus::kBadInput);
  const cv::Mat flat(240, 320, CV_8UC1, cv::Scalar(100));
  patch_ = *CutPatch(flat, {160, 120}, camera_);
  EXPECT_EQ(Warp(Rigid3{}, 1.0), WarpStatus::kLowTexture);
}

TEST_F(PatchTest, NearTheBorderOnlyRealPixelsAreUsed) {
  patch_ = *CutPatch(image_, {9, 9}, camera_);
  EXPECT_EQ(patch_.valid, cv::Rect(11, 11, 30, 30));
  ASSERT_EQ(Warp(Rigid3{}, 1.0), WarpStatus::kOk);
  EXPECT_EQ(warped_.fine.size, 11);
  EXPECT_EQ(CutPatch(image_, {7, 120}, camera_).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(CutPatch(image_, {160, 233}, camera_).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(CutPatch(image_, {NAN, 120}, camera_).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CutPatch(cv::Mat(), {100, 120}, camera_).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(PatchTest, GivenTemplatesKeepTheirSizeAndShrinkUnderRoll) {
  const cv::Mat square = image_(cv::Rect(156, 119, 11, 11)).clone();
  patch_ = *PatchFromImage(square, {161, 124}, camera_);
  ASSERT_EQ(Warp(Rigid3{}, 1.0), WarpStatus::kOk);
  EXPECT_EQ(warped_.fine.size, 11);
  EXPECT_EQ(warped_.coarse.size, 0);
  ASSERT_EQ(Warp({ExpQuaternion({0, 0, 0.5}), {0, 0, 0}}, 1.0), WarpStatus::kOk);
  EXPECT_LT(warped_.fine.size, 11);
  EXPECT_FALSE(PatchFromImage(cv::Mat(10, 10, CV_8UC1), {161, 124}, camera_).ok());
  EXPECT_FALSE(PatchFromImage(cv::Mat(43, 43, CV_8UC1), {161, 124}, camera_).ok());
}

}  // namespace
}  // namespace saccade::patch_test
