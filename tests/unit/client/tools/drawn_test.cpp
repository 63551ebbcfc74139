#include "client/tools/drawn.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace saccade::tools::drawn_test {
namespace {

View Facing(double yaw_rad, const Eigen::Vector3d& eye = Eigen::Vector3d::Zero()) {
  Rigid3 pose;
  pose.rotation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY());
  pose.translation = eye;
  return {PinholeOf(640, 480, 0.8), pose};
}

TEST(Drawn, ItLiesOnTheSurfaceThatWasPressedOrFacesTheEye) {
  const View view = Facing(0.3);
  Landing landing;
  landing.point_in_world = view.world_from_camera * Eigen::Vector3d(0, 0, 2);
  const Plane facing = PlaneOf(view, landing);
  const auto beside = OnPlane(view, facing, {100, 400});
  ASSERT_TRUE(beside);
  EXPECT_NEAR(view.Depth(*beside), 2, 1e-9) << "as deep as what was pressed";
  landing.normal_in_world = Eigen::Vector3d::UnitY();
  landing.point_in_world.y() = 0.5;
  const auto on_table = OnPlane(view, PlaneOf(view, landing), {100, 400});
  ASSERT_TRUE(on_table);
  EXPECT_NEAR(on_table->y(), 0.5, 1e-9);
  EXPECT_LT((*view.Project(*on_table) - Eigen::Vector2d(100, 400)).norm(), 1e-6);
}

TEST(Drawn, ABoxHasItsCornersWhereTheyWereDrawnAndDepthOfItsOwn) {
  const View view = Facing(0.7);
  const Rigid3& pose = view.world_from_camera;
  const Eigen::Vector3d a = pose * Eigen::Vector3d(-0.2, -0.1, 2);
  const Eigen::Vector3d b = pose * Eigen::Vector3d(0.2, 0.2, 2);
  const DrawnBox box = BoxBetween(view, a, b);
  EXPECT_LT((box.middle_in_world - 0.5 * (a + b)).norm(), 1e-12);
  EXPECT_LT((box.extent_m - Eigen::Vector3d(0.4, 0.3, 0.15)).norm(), 1e-9)
      << box.extent_m.transpose();
  const Eigen::Vector3d across = box.world_from_mark * Eigen::Vector3d::UnitX();
  EXPECT_LT((across - pose.rotation * Eigen::Vector3d::UnitX()).norm(), 1e-9);
  const Eigen::Vector3d corner = box.world_from_mark.conjugate() * (b - box.middle_in_world);
  EXPECT_NEAR(corner.x(), 0.5 * box.extent_m.x(), 1e-9);
  EXPECT_NEAR(corner.y(), 0.5 * box.extent_m.y(), 1e-9);
}

TEST(Drawn, ABoxIsNeverThinnerThanWhatTheServerTakes) {
  const View view = Facing(0);
  EXPECT_GE(BoxBetween(view, {0, 0, 2}, {0, 0, 2}).extent_m.minCoeff(), 0.01);
  EXPECT_LE(BoxBetween(view, {-40, 0, 2}, {40, 9, 2}).extent_m.maxCoeff(), 10);
}

TEST(Drawn, AStrokeBeginsAtItsAnchorAndIsSmoothedBetweenItsEnds) {
  EXPECT_TRUE(StrokeOf({{1, 2, 3}}).empty());
  const auto stroke = StrokeOf({{1, 2, 3}, {1.1, 2.2, 3}, {1.2, 2, 3}});
  ASSERT_EQ(stroke.size(), 3u);
  EXPECT_EQ(stroke[0], Eigen::Vector3d::Zero());
  EXPECT_LT((stroke[1] - Eigen::Vector3d(0.1, 0.1, 0)).norm(), 1e-12);
  EXPECT_LT((stroke[2] - Eigen::Vector3d(0.2, 0, 0)).norm(), 1e-12);
  const std::vector<Eigen::Vector3d> many(5001, Eigen::Vector3d(0.5, 0, 0));
  EXPECT_LE(StrokeOf(many).size(), 2000u);
}

}  // namespace
}  // namespace saccade::tools::drawn_test
