#include "server/scene/placement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shared/models/shapes.hpp"

namespace saccade::placement_test {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr std::uint32_t kGrey = 0xb4b4b4ff;

Obstacle At(const char* name, const TriangleMesh& mesh, const Vector3d& where,
            const Eigen::Quaterniond& turn = Eigen::Quaterniond::Identity()) {
  Obstacle obstacle{name, name, {}};
  Append(mesh, {turn, where}, 1.0, obstacle.in_world);
  return obstacle;
}

std::vector<Obstacle> Room() {
  return {At("room", RoomMesh({4, 2.5, 4}, kGrey), Vector3d::Zero())};
}

PlacementRequest From(const Vector3d& where, std::optional<Vector3d> push = std::nullopt) {
  PlacementRequest request;
  request.world_from_body.translation = where;
  request.push = push;
  return request;
}

const Body& Crate() {
  static const Body crate(BoxMesh({0.4, 0.3, 0.2}, kGrey));
  return crate;
}

TEST(Place, AThingFallsToTheFloor) {
  const auto placed = Place(CollisionScene(Room()), Crate(), From({0, -1, 0}));
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_NEAR(placed->world_from_body.translation.y(), -kContactGap_m, 1e-9);
  EXPECT_EQ(placed->support.obstacle_name, "room");
  EXPECT_NEAR(placed->support.normal_in_world.y(), -1, 1e-9);
  EXPECT_FALSE(placed->stop);
}

TEST(Place, OnTheFloorItIsPushedToTheWall) {
  const auto placed = Place(CollisionScene(Room()), Crate(), From({0, 0, 0}, Vector3d(2, 0.3, 0)));
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_NEAR(placed->world_from_body.translation.x(), 2 - 0.2 - kContactGap_m, 1e-6);
  EXPECT_NEAR(placed->world_from_body.translation.y(), -kContactGap_m, 1e-6);
  EXPECT_NEAR(placed->stop->normal_in_world.x(), -1, 1e-6);
  EXPECT_NEAR(placed->stop->moved_m, 1.8 - kContactGap_m, 1e-6);
}

TEST(Place, AslantIntoAWallItSlidesAsFarAsTheHandGoes) {
  PlacementRequest request = From({0, 0, 0}, Vector3d(1, 0, 0.5));
  request.hand_m = 2.5;
  const auto placed = Place(CollisionScene(Room()), Crate(), request);
  ASSERT_TRUE(placed.ok()) << placed.status();
  // At the wall x = 2 after 1.8 m along x, and as far along z as the hand.
  const Vector3d way = Vector3d(1, 0, 0.5).normalized();
  EXPECT_NEAR(placed->world_from_body.translation.x(), 2 - 0.2, 1e-3);
  EXPECT_NEAR(placed->world_from_body.translation.z(), 2.5 * way.z(), 1e-3);
  EXPECT_NEAR(placed->world_from_body.translation.y(), -kContactGap_m, 1e-6);
  EXPECT_NEAR(placed->stop->normal_in_world.x(), -1, 1e-6);
  EXPECT_NEAR(placed->slid_m, 2.5 * way.z() - 1.8 * way.z() / way.x(), 1e-3);
  EXPECT_FALSE(placed->slide_stop);
}

TEST(Place, ItSlidesIntoACornerAndStaysThere) {
  std::vector<Obstacle> obstacles = Room();
  obstacles.push_back(At("post", BoxMesh({0.2, 1, 0.2}, kGrey), {1.9, 0, 1.2}));
  for (const bool post : {false, true}) {
    PlacementRequest request = From({0, 0, 0}, Vector3d(1, 0, 0.5));
    request.hand_m = 12;
    const auto placed = Place(CollisionScene(post ? obstacles : Room()), Crate(), request);
    ASSERT_TRUE(placed.ok()) << placed.status();
    EXPECT_NEAR(placed->world_from_body.translation.x(), 2 - 0.2, 1e-3);
    EXPECT_NEAR(placed->world_from_body.translation.z(), (post ? 1.1 : 2.0) - 0.1, 1e-3);
    ASSERT_TRUE(placed->slide_stop);
    EXPECT_EQ(placed->slide_stop->obstacle_name, post ? "post" : "room");
  }
}

TEST(Place, HeadOnItDoesNotSlide) {
  PlacementRequest request = From({0, 0, 0}, Vector3d(1, 0, 0.01));
  request.hand_m = 5;
  auto placed = Place(CollisionScene(Room()), Crate(), request);
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_EQ(placed->slid_m, 0);
  request.hand_m = -1;
  EXPECT_THAT(Place(CollisionScene(Room()), Crate(), request).status().message(),
              HasSubstr("hand_m: -1; give"));
}

TEST(Place, ThroughAThinSheetNothingPasses) {
  std::vector<Obstacle> obstacles = Room();
  const Eigen::Quaterniond upright(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ()));
  obstacles.push_back(At("sheet", PlaneMesh(1, 1, kGrey), {1, -0.5, 0}, upright));
  const Body paper(BoxMesh({0.001, 0.3, 0.2}, kGrey));
  const auto placed =
      Place(CollisionScene(obstacles), paper, From({0, -0.1, 0}, Vector3d(1, 0, 0)));
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_EQ(placed->stop->obstacle_name, "sheet");
  EXPECT_NEAR(placed->world_from_body.translation.x(), 1 - 0.0005 - kContactGap_m, 1e-6);
}

TEST(Place, ASmallThingInTheMiddleOfALargeFaceStopsIt) {
  std::vector<Obstacle> obstacles = Room();
  obstacles.push_back(At("peg", BoxMesh({0.02, 0.02, 0.02}, kGrey), {1, -0.5, 0}));
  const Body board(BoxMesh({0.02, 1, 1}, kGrey));
  const auto placed =
      Place(CollisionScene(obstacles), board, From({0, -0.1, 0}, Vector3d(1, 0, 0)));
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_EQ(placed->stop->obstacle_name, "peg");
}

TEST(Place, UnderATableIsRoomForWhatFits) {
  std::vector<Obstacle> obstacles = Room();
  TriangleMesh table;
  Append(BoxMesh({1, 0.05, 1}, kGrey), {Eigen::Quaterniond::Identity(), {0, -0.7, 0}}, 1, table);
  Append(BoxMesh({0.05, 0.7, 0.05}, kGrey), {Eigen::Quaterniond::Identity(), {0.45, 0, 0}}, 1,
         table);
  obstacles.push_back(At("table", table, {1, 0, 0}));
  const CollisionScene scene(obstacles);
  const auto under = Place(scene, Crate(), From({-0.5, 0, 0}, Vector3d(1, 0, 0)));
  ASSERT_TRUE(under.ok()) << under.status();
  EXPECT_NEAR(under->world_from_body.translation.x(), 1.45 - 0.025 - 0.2 - kContactGap_m, 1e-6);
  const auto above = Place(scene, Crate(), From({1, -1.5, 0}));
  ASSERT_TRUE(above.ok()) << above.status();
  EXPECT_NEAR(above->world_from_body.translation.y(), -0.75 - kContactGap_m, 1e-6);
  EXPECT_EQ(above->support.obstacle_name, "table");
}

TEST(Place, WhatCannotBeIsRefusedWithTheReason) {
  const auto message = [](const std::vector<Obstacle>& obstacles, const PlacementRequest& request) {
    const auto placed = Place(CollisionScene(obstacles), Crate(), request);
    return placed.ok() ? "placed" : std::string(placed.status().message());
  };
  std::vector<Obstacle> obstacles = Room();
  obstacles.push_back(At("block", BoxMesh({1, 1, 1}, kGrey), Vector3d::Zero()));
  EXPECT_THAT(message(obstacles, From({0, -0.4, 0})), HasSubstr("inside of 'block'"));
  EXPECT_THAT(message(Room(), From({1.95, -1, 0})), HasSubstr("inside of 'room'"));
  const std::vector<Obstacle> deep = {At("floor", PlaneMesh(9, 9, kGrey), {0, 5.1, 0})};
  EXPECT_THAT(message(deep, From({0, 0, 0})), HasSubstr("nothing holds it within 5 m"));
  EXPECT_EQ(message(deep, From({0, 0.2, 0})), "placed");
  EXPECT_THAT(message(deep, From({0, 1, 0}, Vector3d(1, 0, 0))), HasSubstr("nothing stops it"));
  EXPECT_THAT(message(deep, From({0, 1, 0}, Vector3d(0, 1, 0))), HasSubstr("along the floor"));
  EXPECT_THAT(message({}, From({0, 0, 0})), HasSubstr("nothing holds it"));
  const double nan = std::nan("");
  EXPECT_THAT(message(Room(), From({0, nan, 0})), HasSubstr("not finite"));
}

TEST(CollisionScene, AThingThatHoldsAnotherInsideOverlaps) {
  const CollisionScene scene({At("lamp", BoxMesh({0.1, 0.1, 0.1}, kGrey), Vector3d::Zero())});
  const Body hood(BoxMesh({1, 1, 1}, kGrey));
  EXPECT_TRUE(scene.Overlap(hood, {Eigen::Quaterniond::Identity(), {0, 0.5, 0}}));
  EXPECT_FALSE(scene.Overlap(hood, {Eigen::Quaterniond::Identity(), {2, 0.5, 0}}));
}

}  // namespace
}  // namespace saccade::placement_test
