#include "server/map/lens_adjustment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "server/filter/point_model.hpp"

namespace saccade::lens_adjustment_test {
namespace {

constexpr double kNoise_px = 0.4;

CameraIntrinsics TrueLens() {
  CameraIntrinsics lens;
  lens.model = LensModel::kBrownConrady;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = 470.0;
  lens.cx = 328.0;
  lens.cy = 231.0;
  lens.distortion = {-0.12, 0.04, 0.0, 0.0, 0.0};
  return lens;
}

/// Seen from 24 places: `turn_rad` is how far the camera turns, `way_m` how far it goes.
LensBundle Seen(unsigned seed, double turn_rad, double way_m) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const CameraModel camera(TrueLens());
  std::vector<Rigid3> truth;
  for (int k = 0; k < 24; ++k) {
    const double t = k / 23.0 * 2.0 * std::numbers::pi;
    const Eigen::Vector3d turn(0.6 * std::sin(2.0 * t), std::sin(t), 0.8 * std::sin(1.5 * t));
    const Eigen::Vector3d at(std::sin(t), 0.7 * std::sin(1.3 * t), 0.8 * std::sin(0.8 * t));
    truth.push_back({ExpQuaternion(turn_rad * turn), way_m * at});
  }
  LensBundle bundle;
  CameraIntrinsics guess = TrueLens();
  guess.model = LensModel::kPinhole;
  guess.distortion = {};
  guess.fx = guess.fy = 554.3;  // 60 deg
  guess.cx = 319.5;
  guess.cy = 239.5;
  bundle.lens = bundle.prior = LensVectorOf(guess);
  LensVector sigma;
  sigma << 0.25, 20.0, 20.0, 0.2, 0.3, 0.004, 0.004, 0.3;
  bundle.prior_covariance = sigma.cwiseAbs2().asDiagonal();
  const CameraModel assumed(guess);
  for (const Rigid3& pose : truth) {
    bundle.world_from_camera.push_back(
        {(pose.rotation * ExpQuaternion(0.01 * Eigen::Vector3d(unit(random), unit(random), 0.0)))
             .normalized(),
         pose.translation + 0.01 * Eigen::Vector3d(unit(random), unit(random), unit(random))});
  }
  bundle.world_from_camera.front() = truth.front();
  const auto see = [&](const Rigid3& pose,
                       const Eigen::Vector3d& point) -> std::optional<Eigen::Vector2d> {
    const auto pixel = camera.Project(pose.Inverse() * point);
    if (!pixel || !camera.InImage(*pixel)) return std::nullopt;
    return *pixel + kNoise_px * Eigen::Vector2d(gauss(random), gauss(random));
  };
  for (int k = 0; k < 150; ++k) {
    const Eigen::Vector3d point(1.2 * unit(random), 0.9 * unit(random), 2.0 + 0.8 * unit(random));
    int anchor = -1;
    for (std::size_t view = 0; view < truth.size(); ++view) {
      const auto pixel = see(truth[view], point);
      if (!pixel) continue;
      if (anchor >= 0) {
        bundle.sightings.push_back({static_cast<int>(view),
                                    static_cast<int>(bundle.points.size()) - 1, *pixel, kNoise_px});
        continue;
      }
      anchor = static_cast<int>(view);
      const double range = (truth[view].Inverse() * point).norm();
      bundle.points.push_back({anchor, *assumed.Unproject(*pixel),
                               (1.0 + 0.1 * unit(random)) / range, *pixel, kNoise_px});
    }
  }
  return bundle;
}

std::optional<LensBundleSolution> Adjusted(const LensBundle& bundle) {
  const std::atomic<bool> stop = false;
  return AdjustLens(bundle, TrueLens(), stop);
}

TEST(LensAdjustment, SixtyDegreesBecomeTheLens) {
  double worst_sigmas = 0.0;
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    const auto found = Adjusted(Seen(seed, /*turn_rad=*/0.25, /*way_m=*/0.4));
    ASSERT_TRUE(found) << seed;
    const CameraIntrinsics lens = LensOf(found->problem.lens, TrueLens());
    EXPECT_NEAR(lens.fx, TrueLens().fx, 0.005 * TrueLens().fx) << seed;
    EXPECT_LT(found->rms_px_after, 2.0 * kNoise_px) << seed;
    EXPECT_LT(found->rms_px_after, found->rms_px_before) << seed;
    const LensVector off = found->problem.lens - LensVectorOf(TrueLens());
    const LensVector sigma = found->covariance.diagonal().cwiseSqrt();
    EXPECT_LT(sigma[0], 0.004) << seed;
    worst_sigmas = std::max(worst_sigmas, off.cwiseQuotient(sigma).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst_sigmas, 4.0);  // of 25 numbers
}

TEST(LensAdjustment, ACameraThatDoesNotTurnSaysThatItKnowsLittle) {
  const auto turning = Adjusted(Seen(1, 0.25, 0.4));
  const auto straight = Adjusted(Seen(1, 0.0, 0.4));
  ASSERT_TRUE(turning);
  ASSERT_TRUE(straight);
  EXPECT_GT(straight->covariance(0, 0), 25.0 * turning->covariance(0, 0));
}

TEST(LensAdjustment, ThePlaceStaysWhereItWasAndAsLarge) {
  const LensBundle bundle = Seen(3, 0.25, 0.4);
  const auto found = Adjusted(bundle);
  ASSERT_TRUE(found);
  const auto& before = bundle.world_from_camera;
  const auto& after = found->problem.world_from_camera;
  EXPECT_LT((before.front().translation - after.front().translation).norm(), 1e-12);
  EXPECT_LT(RotationAngle(before.front(), after.front()), 1e-9);
  double was = 0.0, is = 0.0;
  for (std::size_t k = 1; k < before.size(); ++k) {
    was += (before[k].translation - before.front().translation).norm();
    is += (after[k].translation - after.front().translation).norm();
  }
  EXPECT_NEAR(is, was, 1e-9);
}

TEST(LensAdjustment, TooLittleIsNoLens) {
  LensBundle bundle = Seen(1, 0.25, 0.4);
  bundle.sightings.resize(100);
  EXPECT_FALSE(Adjusted(bundle));
  std::atomic<bool> stop = true;
  EXPECT_FALSE(AdjustLens(Seen(1, 0.25, 0.4), TrueLens(), stop));
}

TEST(LensAdjustment, AVectorIsTheCameraItWasMadeOf) {
  const CameraIntrinsics lens = LensOf(LensVectorOf(TrueLens()), TrueLens());
  EXPECT_NEAR(lens.fx, TrueLens().fx, 1e-9);
  EXPECT_EQ(lens.cx, TrueLens().cx);
  EXPECT_EQ(lens.distortion, TrueLens().distortion);
  EXPECT_EQ(lens.width, 640);
}

}  // namespace
}  // namespace saccade::lens_adjustment_test
