// What several clicks make: measured, laid over a room, registered.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "client/tools/measured.hpp"
#include "client/tools/overlays.hpp"
#include "client/tools/registering.hpp"
#include "shared/models/gltf_reader.hpp"

namespace saccade::tools::things_by_clicks_test {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

Landing At(const Vector3d& point, How how = How::kFeature) {
  Landing landing;
  landing.point_in_world = point;
  landing.how = how;
  return landing;
}

/// From the world's origin along z.
View Ahead() { return {PinholeOf(640, 480, 1.0), Rigid3()}; }

std::string WhyNot(const absl::Status& status) { return std::string(status.message()); }

TEST(Measuring, APlaneGoesThroughItsThreePointsAndFacesWhoLooks) {
  const Vector3d a(-1, 1, 3), b(1, 1, 3), c(0.4, 1, 1);
  for (const Vector3d& eye : {Vector3d(0, 0, 0), Vector3d(0, 2, 0)}) {
    const auto plane = PlaneOf(a, b, c, eye);
    ASSERT_TRUE(plane.ok()) << plane.status();
    EXPECT_LT((plane->size_m - Vector3d(2, 0, 2)).norm(), 1e-12);
    EXPECT_LT((plane->pose.translation - Vector3d(0, 1, 2)).norm(), 1e-12);
    const Vector3d up = plane->pose.rotation * -Vector3d::UnitY();
    EXPECT_NEAR(up.dot((eye - a).normalized()), std::abs(eye.y() - 1) / (eye - a).norm(), 1e-12);
  }
  EXPECT_THAT(WhyNot(PlaneOf(a, b, (a + b) / 2, {0, 0, 0}).status()), HasSubstr("of a line"));
}

TEST(Measuring, ABoxStandsOnItsLowerCornerAsTheRoomIsTurned) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.4, Vector3d::UnitY()));
  const Vector3d low(0.5, 1, 2), high = low + turn * Vector3d(0.3, -0.2, 0.1);
  const auto box = BoxOf(low, high, turn);
  ASSERT_TRUE(box.ok()) << box.status();
  EXPECT_LT((box->size_m - Vector3d(0.3, 0.2, 0.1)).norm(), 1e-12);
  EXPECT_NEAR(box->pose.translation.y(), 1, 1e-12);
  EXPECT_THAT(WhyNot(BoxOf(low, low + turn * Vector3d(0.3, 0, 0.1), turn).status()),
              HasSubstr("0 mm high"));
}

TEST(Measuring, ARoomIsFoundWhicheverWallIsClickedFirst) {
  const Rigid3 pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d::UnitY())), {1, 1.2, -2}};
  const auto in = [&pose](double x, double y, double z) -> Vector3d {
    return pose * Vector3d(x, y, z);
  };
  RoomPoints points{in(0.3, 0, 0.2),
                    {in(-1, -1, 1.5), in(1.1, -2, 1.5)},
                    {in(-2, -1, 0), in(2, -0.5, 0.4)},
                    in(0.2, -1, -1.5)};
  for (int swapped = 0; swapped < 2; ++swapped) {
    const auto room = RoomOf(points, 2.5);
    ASSERT_TRUE(room.ok()) << room.status();
    EXPECT_LT((room->size_m - Vector3d(4, 2.5, 3)).norm(), 1e-9);
    EXPECT_LT((room->pose.translation - pose.translation).norm(), 1e-9);
    EXPECT_NEAR(std::abs(room->pose.rotation.dot(pose.rotation)), 1, 1e-12);
    std::swap(points.wall[0], points.wall[1]);
    std::swap(points.sides[0], points.sides[1]);
  }
  points.opposite = points.wall[0];
  EXPECT_THAT(WhyNot(RoomOf(points, 2.5).status()), HasSubstr("0 mm apart"));
  points.wall[1] = points.wall[0] - Vector3d::UnitY();
  EXPECT_THAT(WhyNot(RoomOf(points, 2.5).status()), HasSubstr("above each other"));
}

TEST(Measuring, CountsClicksTakesWhatWasMeasuredAloneAndBeginsAnewAfterAMistake) {
  Measuring measuring;
  const Scene scene;
  EXPECT_EQ(measuring.Hint(SceneShape::kBox), "Box, corner 1 of 2: click a lower corner.");
  const auto guessed =
      measuring.Click(SceneShape::kBox, At({0, 1, 2}, How::kNearbyDepth), Ahead(), scene);
  EXPECT_EQ(WhyNot(guessed.status()), kUnmeasured);
  EXPECT_FALSE(measuring.Click(SceneShape::kBox, std::nullopt, Ahead(), scene).ok());
  const auto first = measuring.Click(SceneShape::kBox, At({0, 1, 2}), Ahead(), scene);
  ASSERT_TRUE(first.ok());
  EXPECT_FALSE(first->has_value());
  EXPECT_EQ(measuring.Hint(SceneShape::kBox),
            "Box, corner 2 of 2: click the opposite upper corner.");
  EXPECT_THAT(WhyNot(measuring.Click(SceneShape::kBox, At({0, 1, 2}), Ahead(), scene).status()),
              HasSubstr("already"));
  EXPECT_EQ(measuring.points().size(), 1u);
  EXPECT_THAT(WhyNot(measuring.Click(SceneShape::kBox, At({0.3, 1, 2.2}), Ahead(), scene).status()),
              HasSubstr("0 mm high"));
  EXPECT_TRUE(measuring.points().empty());
  ASSERT_TRUE(measuring.Click(SceneShape::kBox, At({0, 1, 2}), Ahead(), scene).ok());
  const auto box = measuring.Click(SceneShape::kBox, At({0.3, 0.8, 2.1}), Ahead(), scene);
  ASSERT_TRUE(box.ok() && box->has_value()) << box.status();
  EXPECT_EQ((*box)->name, "box");
  EXPECT_EQ((*box)->material, SceneMaterial::kReal);
  EXPECT_LT(((*box)->size_m - Vector3d(0.3, 0.2, 0.1)).norm(), 1e-12);
}

TEST(Overlaying, AWayIsLaidPointByPointAndEndsWhereItIsClickedAgain) {
  Overlaying overlaying;
  const Scene scene;
  EXPECT_FALSE(overlaying.Finish(OverlayKind::kPipe, scene).ok());
  const Vector3d out(0, 0, -1);
  for (const Vector3d& point : {Vector3d(0, 0, 3), Vector3d(1, 0, 3), Vector3d(1, 1, 3)}) {
    const auto laid = overlaying.Click(OverlayKind::kPipe, {point, out}, scene);
    ASSERT_TRUE(laid.ok());
    ASSERT_FALSE(laid->has_value());
  }
  EXPECT_EQ(overlaying.Hint(OverlayKind::kPipe),
            "Point 4: click the wall along it; the last point again, or Done, ends it.");
  const auto laid = overlaying.Click(OverlayKind::kPipe, {{1, 1.01, 3}, out}, scene);
  ASSERT_TRUE(laid.ok() && laid->has_value()) << laid.status();
  EXPECT_TRUE(overlaying.points().empty());
  const SceneObject& pipe = (*laid)->thing;
  EXPECT_EQ(pipe.material, SceneMaterial::kHidden);
  EXPECT_LT((pipe.parent_from_object.translation - Vector3d(0, 0, 3.05)).norm(), 1e-12)
      << "5 cm inside its wall";
  const auto mesh = ReadGlb((*laid)->file);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  Eigen::Vector3f low = mesh->positions.front(), high = low;
  for (const Eigen::Vector3f& each : mesh->positions) {
    low = low.cwiseMin(each);
    high = high.cwiseMax(each);
  }
  EXPECT_NEAR(low.x(), 0, 1e-6);
  EXPECT_NEAR(high.y(), 1, 1e-6);
  EXPECT_LT(high.x(), 1.03);
}

TEST(Overlaying, AGridCoversTheFloorThatWasClickedAndAnArrowComesFromAbove) {
  Scene scene;
  SceneObject floor;
  floor.shape = SceneShape::kPlane;
  floor.size_m = {2, 0, 4};
  floor.parent_from_object.translation = {1, 1, 2};
  scene.objects = {floor};
  Overlaying overlaying;
  const ThingHit hit{&scene.objects[0], {0.5, 1, 1}, -Vector3d::UnitY()};
  const auto grid =
      overlaying.Click(OverlayKind::kGrid, {hit.point_in_world, hit.normal_in_world, hit}, scene);
  ASSERT_TRUE(grid.ok() && grid->has_value());
  EXPECT_EQ((*grid)->thing.material, SceneMaterial::kGuide);
  EXPECT_LT(((*grid)->thing.parent_from_object.translation - Vector3d(1, 1, 2)).norm(), 1e-12);
  const auto lines = ReadGlb((*grid)->file);
  ASSERT_TRUE(lines.ok()) << lines.status();
  EXPECT_EQ(lines->triangles.size(), 2u * (9 + 17)) << "lines 25 cm apart";
  const auto pointer = overlaying.Click(OverlayKind::kPointer, {{0, 0, 2}, {0, 0, -1}}, scene);
  ASSERT_TRUE(pointer.ok() && pointer->has_value());
  const auto arrow = ReadGlb((*pointer)->file);
  ASSERT_TRUE(arrow.ok()) << arrow.status();
  for (const Eigen::Vector3f& each : arrow->positions) {
    EXPECT_LT(each.y(), 0.05) << "from above";
    EXPECT_LT(each.z(), 0.05) << "out of the wall";
  }
}

TEST(Registering, PairsAreClickedInTurnAndTheErrorIsSaidBeforeItIsAccepted) {
  Scene scene;
  SceneObject box;
  box.id = "b";
  box.name = "crate";
  box.size_m = {0.4, 0.2, 0.4};
  box.parent_from_object.translation = {0, 0.1, 2};
  scene.objects = {box};
  const View view = Ahead();
  Registering registering;
  EXPECT_EQ(registering.Step(scene), "Select the thing in the list first.");
  registering.Begin("b");
  EXPECT_EQ(registering.Step(scene), "Point 1: click a corner of crate.");
  const Vector3d corner(0.2, -0.2, -0.2);
  const Eigen::Vector2d at = *view.Project(box.parent_from_object * corner);
  EXPECT_THAT(WhyNot(registering.Click(scene, view, at + Eigen::Vector2d(40, 0), {}, 20).status()),
              HasSubstr("no corner of crate"));
  const auto took = registering.Click(scene, view, at + Eigen::Vector2d(5, 5), {}, 20);
  ASSERT_TRUE(took.ok()) << took.status();
  EXPECT_EQ(*took, Registering::Took::kCorner);
  EXPECT_EQ(registering.Step(scene), "Point 1: click the same point in the map or the video.");
  EXPECT_FALSE(registering.Click(scene, view, at, At({0, 0, 1}, How::kUnknownDepth), 20).ok());
  ASSERT_TRUE(registering.Click(scene, view, at, At({0.3, 0, 2}), 20).ok());
  ASSERT_EQ(registering.pairs().size(), 1u);
  EXPECT_LT((registering.pairs()[0].in_object - corner).norm(), 1e-12);
  EXPECT_EQ(registering.Total(), "3 more points");
  registering.result = net::RegisteredThing{box, 2.34, 5.1, {1.2}, {3.4}};
  EXPECT_EQ(registering.Total(), "error 2.3 mm; to expect elsewhere 5.1 mm");
  EXPECT_EQ(registering.PairWords(0), "1.2 mm, by the others 3.4 mm");
  registering.Drop(0);
  EXPECT_EQ(registering.Total(), "4 more points") << "the error was of other pairs";
}

TEST(Registering, AModelsCornersAreThoseOfItsMeshBeforeItsScale) {
  Scene scene;
  auto model = std::make_shared<SceneModel>();
  model->id = "m";
  model->mesh.positions = {{0, 0, 0}, {0.1f, 0, 0}, {0, -0.1f, 0}};
  scene.models = {model};
  SceneObject thing;
  thing.shape = SceneShape::kModel;
  thing.model = "m";
  thing.scale = 2;
  thing.parent_from_object.translation = {0, 0, 2};
  const View view = Ahead();
  const auto corner = CornerAt(scene, thing, view, *view.Project({0.2, 0, 2}), 5);
  ASSERT_TRUE(corner);
  EXPECT_NEAR(corner->x(), 0.1, 1e-6);
  scene.models.clear();
  EXPECT_FALSE(CornerAt(scene, thing, view, *view.Project({0.2, 0, 2}), 5)) << "not fetched yet";
}

}  // namespace
}  // namespace saccade::tools::things_by_clicks_test
