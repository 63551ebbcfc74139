#include "server/anchors/measure.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "tests/unit/server/anchors/rig.hpp"

namespace saccade::measure_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::LookFrom;
using testing::Rig;
using testing::SyntheticMap;

TEST(LengthSigma, TheWorkedNumberOfTheProtoFile) {
  const Matrix3d three_mm = 9e-6 * Matrix3d::Identity();
  EXPECT_NEAR(LengthSigma({0.5, 0, 0}, three_mm, three_mm, Matrix3d::Zero()), 4.24e-3, 5e-6);
  EXPECT_NEAR(LengthSigma({0.5, 0, 0}, three_mm, three_mm, three_mm), 0.0, 1e-9)
      << "what both share moves both";
  EXPECT_NEAR(LengthSigma({0, 0, 0}, three_mm, three_mm, Matrix3d::Zero()), 4.24e-3, 5e-6);
}

// Errors of both ends drawn from one covariance of six: what is claimed is what comes out.
TEST(LengthSigma, AgreesWithMonteCarlo) {
  std::mt19937 random(7);
  std::normal_distribution<double> gauss;
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::Matrix<double, 6, 6> root;
    for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = 0.002 * gauss(random);
    const Eigen::Matrix<double, 6, 6> covariance = root * root.transpose();
    const Vector3d offset = Vector3d(gauss(random), gauss(random), gauss(random)).normalized();
    const double claimed =
        LengthSigma(offset, covariance.topLeftCorner<3, 3>(), covariance.bottomRightCorner<3, 3>(),
                    covariance.topRightCorner<3, 3>());
    constexpr int kRuns = 20'000;
    double squares = 0;
    for (int run = 0; run < kRuns; ++run) {
      Eigen::Matrix<double, 6, 1> unit;
      for (int i = 0; i < 6; ++i) unit[i] = gauss(random);
      const Eigen::Matrix<double, 6, 1> error = root * unit;
      squares += std::pow((offset + error.tail<3>() - error.head<3>()).norm() - 1.0, 2);
    }
    EXPECT_NEAR(std::sqrt(squares / kRuns) / claimed, 1.0, 0.03) << trial;
  }
}

AnnotationDraft Between(FrameId frame, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  AnnotationDraft draft;
  draft.shape = AnnotationShape::kMeasure;
  draft.target = PixelTarget{frame, from};
  draft.end_target = PixelTarget{frame, to};
  return draft;
}

// Whole clicks in maps whose landmarks are wrong by what they claim.
TEST(Measure, SigmaIsHonestOverManyMaps) {
  const Rigid3 pose = LookFrom({0, 0, 0}, 0, 0.35);
  double squares = 0, claims = 0;
  int runs = 0, within = 0, untrusted = 0;
  for (unsigned seed = 1; seed <= 120; ++seed) {
    SyntheticMap::Options options;
    options.seed = seed;
    Rig rig(options);
    rig.Show(pose);
    const Eigen::Vector2d from(250 + seed % 7 * 8, 300), to(390, 320 + seed % 5 * 10);
    const double truth = (rig.Truth(pose, from) - rig.Truth(pose, to)).norm();
    const auto made = rig.manager.Create(Between(rig.map.next_frame - 1, from, to), "ann");
    ASSERT_TRUE(made.ok()) << made.status();
    const Annotation& annotation = made->annotation;
    untrusted += annotation.anchor.state == AnchorState::kPaused;
    const double error = annotation.length_m - truth;
    squares += std::pow(error / annotation.length_sigma_m, 2);
    claims += annotation.length_sigma_m;
    within += std::abs(error) < 2 * annotation.length_sigma_m;
    ++runs;
  }
  const double rms = std::sqrt(squares / runs);
  std::printf(
      "measure: %d runs, %d not trusted yet, rms error / sigma %.2f, within 2 sigma %.0f %%, mean "
      "sigma %.1f mm\n",
      runs, untrusted, rms, 100.0 * within / runs, 1e3 * claims / runs);
  EXPECT_LT(rms, 1.3) << "it promises too much";
  EXPECT_GT(rms, 0.2) << "it promises next to nothing";
  EXPECT_GT(within, 0.9 * runs);
}

class MeasureInMap : public ::testing::Test {
 protected:
  MeasureInMap() { rig_.Show(pose_); }
  std::string Make(const Vector3d& from, const Vector3d& to) {
    AnnotationDraft draft;
    draft.shape = AnnotationShape::kMeasure;
    draft.target = PointTarget{from};
    draft.end_target = PointTarget{to};
    const auto made = rig_.manager.Create(draft, "ann");
    EXPECT_TRUE(made.ok()) << made.status();
    return made->annotation.id;
  }
  Annotation Get(const std::string& id) { return rig_.manager.Get(id).value(); }

  const Rigid3 pose_ = LookFrom({0, 0, 0}, 0, 0.2);
  Rig rig_;
};

TEST_F(MeasureInMap, LengthIsBetweenItsEndsAndIsUndoneWithThem) {
  const std::string id = Make({-0.2, 0.1, 2}, {0.3, 0.1, 2});
  EXPECT_NEAR(Get(id).length_m, 0.5, 1e-6);
  EXPECT_NEAR((Get(id).ink_offset_m[0] - Vector3d(0.5, 0, 0)).norm(), 0, 1e-6);
  EXPECT_GT(Get(id).length_sigma_m, 0.0);
  AnnotationPatch patch;
  patch.id = id;
  patch.end_target = PointTarget{{0.8, 0.1, 2}};
  ASSERT_TRUE(rig_.manager.Update(patch, "ann").ok());
  EXPECT_NEAR(Get(id).length_m, 1.0, 1e-6);
  patch.end_target.reset();
  patch.target = PointTarget{{0.4, 0.1, 2}};
  ASSERT_TRUE(rig_.manager.Update(patch, "ann").ok());
  EXPECT_NEAR(Get(id).length_m, 0.4, 1e-6) << "its other end stays";
  ASSERT_TRUE(rig_.manager.Undo("ann").ok());
  EXPECT_NEAR(Get(id).length_m, 1.0, 1e-3);
  ASSERT_TRUE(rig_.manager.Undo("ann").ok());
  EXPECT_NEAR(Get(id).length_m, 0.5, 1e-3);
  ASSERT_TRUE(rig_.manager.Redo("ann").ok());
  EXPECT_NEAR(Get(id).length_m, 1.0, 1e-3);
}

TEST_F(MeasureInMap, FollowsACorrectedMapWithBothEnds) {
  const std::string id = Make({-0.3, 0.1, 2}, {0.3, 0.1, 2});
  rig_.Show(pose_);
  Rigid3 turned;
  turned.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Vector3d::UnitY()));
  turned.translation = {0.2, 0, 0};
  rig_.map.Correct(turned, 0);
  for (int i = 0; i < 10; ++i) rig_.Show(pose_);
  const Annotation now = Get(id);
  const Vector3d expected = turned.rotation * Vector3d(0.6, 0, 0);
  EXPECT_LT((now.ink_offset_m[0] - expected).norm(), 2e-3);
  EXPECT_NEAR(now.length_m, now.ink_offset_m[0].norm(), 1e-9);
}

TEST_F(MeasureInMap, IsNotToldAnewWhileNothingChanges) {
  const std::string id = Make({-0.3, 0.1, 2}, {0.3, 0.1, 2});
  for (int i = 0; i < 30; ++i) rig_.Show(pose_);
  const void* stroke = Get(id).ink_offset_m.identity();
  int told = 0;
  for (int i = 0; i < 60; ++i) {
    rig_.Show(pose_);
    const void* now = Get(id).ink_offset_m.identity();
    told += now != stroke;
    stroke = now;
  }
  EXPECT_LT(told, 12) << "five times a second at most";
}

TEST_F(MeasureInMap, AWrongOtherEndIsNamedSo) {
  AnnotationDraft draft;
  draft.shape = AnnotationShape::kMeasure;
  draft.target = PointTarget{{0, 0, 2}};
  draft.end_target = FeatureTarget{987654};
  const absl::Status status = rig_.manager.Create(draft, "ann").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("end_target.feature_id 987654"));
}

TEST(JoinEnds, IsAsBadAsTheWorse) {
  Anchor good, bad;
  good.state = AnchorState::kTracking;
  bad.state = AnchorState::kPaused;
  bad.reason = "lost";
  bad.error_m = 0.2;
  EXPECT_EQ(JoinEnds(good, bad).state, AnchorState::kPaused);
  EXPECT_EQ(JoinEnds(good, bad).reason, "its other end: lost");
  EXPECT_EQ(JoinEnds(bad, good).reason, "lost");
  EXPECT_EQ(JoinEnds(good, bad).error_m, 0.2);
  bad.place_known = false;
  EXPECT_FALSE(JoinEnds(good, bad).place_known);
}

}  // namespace
}  // namespace saccade::measure_test
