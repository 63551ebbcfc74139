#include "server/scene/registration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace saccade::registration_test {
namespace {

using ::testing::HasSubstr;

const Similarity3 kTruth{1.0, ExpQuaternion({0.3, -1.2, 0.5}), {1.0, -2.0, 3.0}};

std::vector<PointPair> Pairs(const std::vector<Eigen::Vector3d>& points, const Similarity3& truth,
                             double sigma_m = 0) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1);
  std::vector<PointPair> pairs;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d error(noise(random), noise(random), noise(random));
    pairs.push_back({point, truth * point + sigma_m * error});
  }
  return pairs;
}

const std::vector<Eigen::Vector3d> kCorners = {{0, 0, 0},   {1, 0, 0},   {0, 0.8, 0},
                                               {0, 0, 0.6}, {1, 0.8, 0}, {1, 0.8, 0.6}};

TEST(Register, ExactPointsGiveTheExactTransform) {
  Similarity3 scaled = kTruth;
  scaled.scale = 0.37;
  for (const bool with_scale : {false, true}) {
    const Similarity3& truth = with_scale ? scaled : kTruth;
    const auto found = Register(Pairs(kCorners, truth), {.with_scale = with_scale});
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_LT(found->rms_m, 1e-12);
    EXPECT_NEAR(found->map_from_model.scale, truth.scale, 1e-12);
    EXPECT_LT((found->map_from_model * Eigen::Vector3d(3, 2, 1) - truth * Eigen::Vector3d(3, 2, 1))
                  .norm(),
              1e-11);
  }
}

TEST(Register, FourPointsInOnePlaneAreEnough) {
  const auto found = Register(Pairs({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, kTruth));
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT(
      (found->map_from_model * Eigen::Vector3d(0, 0, 1) - kTruth * Eigen::Vector3d(0, 0, 1)).norm(),
      1e-12);
}

TEST(Register, TheErrorLeftOutTellsWhatARegistrationIsWorth) {
  const auto found = Register(Pairs(kCorners, kTruth, 0.005));
  ASSERT_TRUE(found.ok());
  EXPECT_GT(found->rms_m, 0.001);
  EXPECT_LT(found->rms_m, 0.02);
  EXPECT_GT(found->left_out_rms_m, found->rms_m);  // residuals flatter
  ASSERT_EQ(found->errors_m.size(), kCorners.size());
}

TEST(Register, OnePointClickedWrongStandsOut) {
  std::vector<PointPair> pairs = Pairs(kCorners, kTruth, 0.001);
  pairs[4].point_in_map += Eigen::Vector3d(0.2, 0, 0);
  const auto found = Register(pairs);
  ASSERT_TRUE(found.ok());
  const auto worst =
      std::max_element(found->left_out_errors_m.begin(), found->left_out_errors_m.end());
  EXPECT_EQ(worst - found->left_out_errors_m.begin(), 4);
  EXPECT_NEAR(*worst, 0.2, 0.02);
}

TEST(Register, DegenerateSetsAreRefused) {
  const auto message = [](std::vector<PointPair> pairs) {
    const auto found = Register(pairs);
    return found.ok() ? "registered" : std::string(found.status().message());
  };
  EXPECT_THAT(message(Pairs({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, kTruth)), HasSubstr("at least 4"));
  EXPECT_THAT(message(Pairs({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0.001, 0}}, kTruth)),
              HasSubstr("in a row"));
  // Three in a row and one beside: without that one nothing holds the turn about the row.
  EXPECT_THAT(message(Pairs({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1, 0}}, kTruth)),
              HasSubstr("without one of them"));
  EXPECT_THAT(message(Pairs({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, kTruth)),
              HasSubstr("one line"));
  std::vector<PointPair> nan = Pairs(kCorners, kTruth);
  nan[2].point_in_map.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message(nan), HasSubstr("correspondences[2]"));
  std::vector<PointPair> mirrored = Pairs(kCorners, kTruth, 0.002);
  for (PointPair& pair : mirrored) pair.point_in_model.z() *= -1;
  EXPECT_THAT(message(mirrored), HasSubstr("mirrored"));
}

}  // namespace
}  // namespace saccade::registration_test
