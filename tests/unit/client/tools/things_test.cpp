#include "client/tools/things.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace saccade::tools::things_test {
namespace {

SceneObject Box(const char* id, const Eigen::Vector3d& base, const Eigen::Vector3d& size) {
  SceneObject box;
  box.id = box.name = id;
  box.size_m = size;
  box.parent_from_object.translation = base;
  return box;
}

/// A room of 4 x 2.5 x 4 m, its floor at y = 1, with a box of 0.5 m in its middle.
Scene RoomWithABox() {
  Scene scene;
  SceneObject room = Box("room", {0, 1, 0}, {4, 2.5, 4});
  room.shape = SceneShape::kRoom;
  scene.objects = {room, Box("box", {0, 1, 0}, {0.5, 0.5, 0.5})};
  return scene;
}

TEST(Things, ARayMeetsTheBoxBeforeTheRoomBehindItAndARoomFromInside) {
  const Scene scene = RoomWithABox();
  const auto at_box = HitSurface(scene, {{0, 0.75, -1.5}, {0, 0, 2}});
  ASSERT_TRUE(at_box);
  EXPECT_EQ(at_box->thing->id, "box");
  EXPECT_LT((at_box->point_in_world - Eigen::Vector3d(0, 0.75, -0.25)).norm(), 1e-12);
  EXPECT_LT((at_box->normal_in_world + Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  const auto at_wall = HitSurface(scene, {{1, 0, -1.5}, {0, 0, 1}});
  ASSERT_TRUE(at_wall);
  EXPECT_EQ(at_wall->thing->id, "room");
  EXPECT_NEAR(at_wall->point_in_world.z(), 2, 1e-12);
}

TEST(Things, GuidesHoldNothingRoomsArePickedByNobodyAndWhatIsFixedElsewhereIsNotMet) {
  Scene scene = RoomWithABox();
  EXPECT_EQ(PickThing(scene, {{1, 0, -1.5}, {0, 0, 1}}), nullptr);
  const RayTarget ray{{0, 0.75, -1.5}, {0, 0, 1}};
  ASSERT_NE(PickThing(scene, ray), nullptr);
  scene.objects[1].material = SceneMaterial::kGuide;
  EXPECT_EQ(HitSurface(scene, ray)->thing->id, "room");
  EXPECT_EQ(PickThing(scene, ray)->id, "box");
  scene.objects[1].parent = SceneParent::kMarker;
  EXPECT_EQ(PickThing(scene, ray), nullptr);
}

TEST(Things, AModelIsPickedByTheBoxOfItsTrianglesAtItsScaleAndTurn) {
  Scene scene;
  auto mesh = std::make_shared<SceneModel>();
  mesh->id = mesh->name = "m";
  mesh->mesh.positions = {{-0.1f, -1, -0.1f}, {0.1f, 0, 0.1f}, {0.1f, -1, 0.1f}};
  mesh->mesh.triangles = {{0, 1, 2}};
  scene.models = {mesh};
  SceneObject thing = Box("thing", {0, 0, 3}, {9, 9, 9});
  thing.shape = SceneShape::kModel;
  thing.material = SceneMaterial::kVirtual;
  thing.model = "m";
  thing.scale = 2;
  scene.objects = {thing};
  EXPECT_NE(PickThing(scene, {{0.15, -1.5, 0}, {0, 0, 1}}), nullptr);
  EXPECT_EQ(PickThing(scene, {{0.25, -1.5, 0}, {0, 0, 1}}), nullptr);
  scene.objects[0].parent_from_object = TurnedBy(thing.parent_from_object, std::numbers::pi / 4);
  EXPECT_NE(PickThing(scene, {{0.25, -1.5, 0}, {0, 0, 1}}), nullptr);  // a corner is there now
  EXPECT_EQ(EdgesOfBox(scene, scene.objects[0]).size(), 12u);
}

TEST(Things, StandUprightWithTheirFrontToWhoeverLooksAndWaysAreLevel) {
  const Rigid3 start = AboveFloor({1, 1, 2}, {0.6, 0.5, 0.8});
  EXPECT_LT((start.rotation * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_LT((start.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(0.6, 0, 0.8)).norm(),
            1e-12);
  EXPECT_LT(start.translation.y(), 1);  // above it: y is down
  const Eigen::Quaterniond down_ahead(Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitX()));
  EXPECT_LT((WayInWorld(down_ahead, Way::kAway) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((WayInWorld(down_ahead, Way::kRight) - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

TEST(Things, ANameThatIsTakenGetsANumber) {
  const Scene scene = RoomWithABox();
  EXPECT_EQ(FreeName(scene, "chair"), "chair");
  EXPECT_EQ(FreeName(scene, "box"), "box 2");
}

}  // namespace
}  // namespace saccade::tools::things_test
