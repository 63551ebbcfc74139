#include "client/tools/landing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/tools/orbit.hpp"
#include "client/tools/plane.hpp"

namespace saccade::tools::landing_test {
namespace {

constexpr double kFov = 0.8;

View AtOrigin() { return {PinholeOf(640, 480, kFov), Rigid3{}}; }

Features Points(const std::vector<Eigen::Vector3d>& points, double sigma_m = 0.004) {
  Features features;
  for (const Eigen::Vector3d& point : points) {
    FeatureSnapshot feature;
    feature.id = features.size() + 1;
    feature.point_in_world = point;
    feature.covariance_in_world = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
    feature.depth_known = true;
    features[feature.id] = feature;
  }
  return features;
}

TEST(Landing, NearAFeatureItIsAtItsDepthOnTheRayOfTheClick) {
  const View view = AtOrigin();
  const Features features = Points({{0, 0, 2}});
  const Eigen::Vector2d click = *view.Project({0, 0, 2}) + Eigen::Vector2d(10, 0);
  const auto landing = LandingInVideo(view, 7, click, features);
  ASSERT_TRUE(landing);
  EXPECT_EQ(landing->how, How::kFeature);
  EXPECT_NEAR(landing->point_in_world.z(), 2, 1e-9);
  EXPECT_LT((*view.Project(landing->point_in_world) - click).norm(), 1e-6);
  EXPECT_NEAR(*landing->sigma_m, 0.004, 1e-9);
  const auto* target = std::get_if<PixelTarget>(&landing->target);
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(target->frame_id, 7u);
  EXPECT_EQ(target->pixel, click);
}

TEST(Landing, BetweenFeaturesOfAPlaneItIsOnThatPlane) {
  const View view = AtOrigin();
  // z = 2 + x: slanted
  const Features features =
      Points({{-0.2, -0.2, 1.8}, {0.2, -0.2, 2.2}, {-0.2, 0.2, 1.8}, {0.2, 0.2, 2.2}});
  const auto landing = LandingInVideo(view, 1, *view.Project({0.05, 0, 2.05}), features);
  ASSERT_TRUE(landing);
  EXPECT_EQ(landing->how, How::kPlane);
  EXPECT_LT((landing->point_in_world - Eigen::Vector3d(0.05, 0, 2.05)).norm(), 1e-6);
}

TEST(Landing, WithoutFeaturesTheDepthIsUnknownAndSaysSo) {
  const View view = AtOrigin();
  const auto landing = LandingInVideo(view, 1, {320, 240}, {});
  ASSERT_TRUE(landing);
  EXPECT_EQ(landing->how, How::kUnknownDepth);
  EXPECT_EQ(landing->sigma_m, std::nullopt);
  EXPECT_EQ(LandingWords(view, *landing, true), "depth unknown");
}

TEST(Landing, InTheMapItIsTheFeatureItselfOrARayButNothingInAnEmptyCorner) {
  const View view = AtOrigin();
  const Features features = Points({{0, 0, 2}});
  const Eigen::Vector2d at = *view.Project({0, 0, 2});
  const auto on = LandingInMap(view, at + Eigen::Vector2d(4, 0), features);
  ASSERT_TRUE(on);
  EXPECT_EQ(std::get<FeatureTarget>(on->target).feature_id, 1u);
  EXPECT_EQ(on->point_in_world, Eigen::Vector3d(0, 0, 2));
  const auto beside = LandingInMap(view, at + Eigen::Vector2d(15, 0), features);
  ASSERT_TRUE(beside);
  EXPECT_TRUE(std::holds_alternative<RayTarget>(beside->target));
  EXPECT_FALSE(LandingInMap(view, {5, 5}, features));
}

TEST(Landing, TheRingIsAsLargeAsTheUncertaintyAppears) {
  const View view = AtOrigin();
  const auto landing = LandingInVideo(view, 1, *view.Project({0, 0, 2}), Points({{0, 0, 2}}, 0.02));
  const double px = view.Project({0.02, 0, 2})->x() - view.Project({0, 0, 2})->x();
  EXPECT_NEAR(*RingRadius(view, *landing), px, 1e-6);
  EXPECT_EQ(LandingWords(view, *landing, true), "±2 cm");
}

TEST(Pick, TakesTheNearestWithinReachAndNoneWithoutAPlace) {
  const View view = AtOrigin();
  std::vector<Annotation> marks(3);
  marks[0].id = "near";
  marks[0].anchor.point_in_world = {0.02, 0, 2};
  marks[1].id = "far";
  marks[1].anchor.point_in_world = {0.05, 0, 2};
  marks[2].id = "nowhere";
  marks[2].anchor.point_in_world = {0, 0, 2};
  marks[2].anchor.place_known = false;
  const Eigen::Vector2d at = *view.Project({0, 0, 2});
  EXPECT_EQ(PickNearest(view, at, marks, 22)->id, "near");
  EXPECT_EQ(PickNearest(view, at, marks, 1), nullptr);
}

TEST(Plane, OfPointsOnALineThereIsNone) {
  EXPECT_FALSE(FitPlane({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}));
  const auto plane = FitPlane({{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}});
  ASSERT_TRUE(plane);
  EXPECT_NEAR(std::abs(plane->normal.z()), 1, 1e-9);
  EXPECT_FALSE(Intersect(*plane, {0, 0, 2}, {0, 0, 1})) << "behind";
}

TEST(Orbit, EasesToItsGoalWithinAQuarterOfASecondAndKeepsWhatIsUnderThePointer) {
  Orbit orbit;
  orbit.LookAt({1, 0, 3}, 0.5);
  for (int i = 0; i < 15; ++i) orbit.Step(250.0 / 15);
  EXPECT_NEAR(orbit.distance_m(), 1.2, 0.05);
  while (orbit.Step(16)) {
  }
  const View before{PinholeOf(800, 600, kFov), orbit.world_from_camera()};
  const double focal = before.camera->intrinsics().fx;
  const Eigen::Vector3d point =
      before.eye() +
      1.2 / before.Depth(before.eye() + *before.Ray({600, 200})) * *before.Ray({600, 200});
  orbit.Zoom(0.5, (600 - 399.5) / focal, (200 - 299.5) / focal);
  while (orbit.Step(16)) {
  }
  const View after{PinholeOf(800, 600, kFov), orbit.world_from_camera()};
  EXPECT_LT((*after.Project(point) - Eigen::Vector2d(600, 200)).norm(), 0.5);
}

}  // namespace
}  // namespace saccade::tools::landing_test
