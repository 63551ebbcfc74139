#include "server/scene/scene_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "shared/models/shapes.hpp"
#include "tests/unit/server/scene/glb_builder.hpp"

namespace saccade::scene_file_test {
namespace {

using ::testing::HasSubstr;

double Volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const TriangleMesh::Triangle& t : mesh.triangles) {
    const auto at = [&](int k) {
      return mesh.positions[t[static_cast<std::size_t>(k)]].cast<double>().eval();
    };
    sum += at(0).dot(at(1).cross(at(2))) / 6.0;
  }
  return sum;
}

TEST(Shapes, ABoxIsSeenFromOutsideAndARoomFromInside) {
  const Eigen::Vector3d size(1, 2, 3);
  EXPECT_NEAR(Volume(BoxMesh(size, 0)), 6.0, 1e-6);
  EXPECT_NEAR(Volume(RoomMesh(size, 0)), -6.0, 1e-6);
  EXPECT_TRUE(IsClosed(BoxMesh(size, 0)));
  EXPECT_FALSE(IsClosed(PlaneMesh(1, 1, 0)));
}

TEST(Shapes, APlaneShowsItsUpperSide) {
  const TriangleMesh plane = PlaneMesh(2, 4, 0);
  for (const TriangleMesh::Triangle& t : plane.triangles) {
    const Eigen::Vector3f a = plane.positions[t[1]] - plane.positions[t[0]];
    const Eigen::Vector3f b = plane.positions[t[2]] - plane.positions[t[0]];
    EXPECT_LT(a.cross(b).y(), 0);
  }
}

class SceneFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("scene_file_test-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "part.glb", std::ios::binary) << GlbBuilder::Triangle().Bytes();
  }
  std::string MessageOf(const std::string& json) const {
    const absl::StatusOr<SceneContents> scene = ParseScene(json, folder_);
    return scene.ok() ? "read" : std::string(scene.status().message());
  }
  std::filesystem::path folder_;
};

TEST_F(SceneFile, IsReadAndWrittenTheSame) {
  const absl::StatusOr<SceneContents> scene = ParseScene(R"({"objects": [
      {"name": "room", "shape": "room", "size_m": [4, 2.5, 4]},
      {"name": "drawer", "shape": "model", "model": "part.glb", "scale": 2, "material": "virtual",
       "marker": {"family": "apriltag36h11", "id": 3, "side_m": 0.08}, "position_m": [0, -0.5, 1]},
      {"name": "lamp", "shape": "box", "size_m": [0.1, 0.2, 0.1], "material": "guide",
       "color": "#ff8000", "annotation": "1b4e28ba-2fa1-41d2-883f-0016d3cca427",
       "rotation_xyzw": [0, 0.70710678, 0, 0.70710678]}]})",
                                                         folder_);
  ASSERT_TRUE(scene.ok()) << scene.status();
  ASSERT_EQ(scene->objects.size(), 3u);
  ASSERT_EQ(scene->models.size(), 1u);
  EXPECT_EQ(scene->objects[1].parent, SceneParent::kMarker);
  EXPECT_EQ(scene->objects[1].marker_id, 3u);
  EXPECT_EQ(scene->objects[1].marker_side_m, 0.08);
  EXPECT_EQ(scene->objects[2].parent, SceneParent::kAnchor);
  EXPECT_EQ(scene->objects[2].color_rgba, 0xff8000ffu);
  const TriangleMesh drawer = MeshOf(scene->objects[1], scene->models[0].get());
  EXPECT_EQ(drawer.positions[1], Eigen::Vector3f(2, 0, 0));

  const std::string text = SceneToJson(scene->objects);
  const absl::StatusOr<SceneContents> again = ParseScene(text, folder_);
  ASSERT_TRUE(again.ok()) << again.status() << text;
  EXPECT_EQ(SceneToJson(again->objects), text);
}

TEST_F(SceneFile, EachProblemIsNamedWithItsPlace) {
  EXPECT_THAT(MessageOf("{"), HasSubstr("not JSON"));
  EXPECT_THAT(MessageOf("{}"), HasSubstr("scene.objects: is missing"));
  EXPECT_THAT(MessageOf(R"({"objects": [{"shape": "box"}]})"),
              HasSubstr("objects[0].name: is missing"));
  EXPECT_THAT(MessageOf(R"({"objects": [{"name": "a", "shape": "ball"}]})"),
              HasSubstr("objects[0].shape: 'ball' is none of plane, box, room, model"));
  EXPECT_THAT(MessageOf(R"({"objects": [{"name": "a", "shape": "box", "size_m": [1, 0, 1]}]})"),
              HasSubstr("objects[0].size_m.y: 0; give"));
  EXPECT_THAT(MessageOf(R"({"objects": [{"name": "a", "shape": "box", "size_m": [1, 1, 1],
                                         "colour": "red"}]})"),
              HasSubstr("objects[0].colour: is not known"));
  EXPECT_THAT(MessageOf(R"({"objects": [{"name": "a", "shape": "model",
                                         "model": "../../secret.glb"}]})"),
              HasSubstr("outside the scene's folder"));
  EXPECT_THAT(MessageOf(R"({"objects": [{"name": "a", "shape": "box", "size_m": [1, 1, 1],
                                         "marker": {"family": "apriltag36h11", "id": 3}}]})"),
              HasSubstr("objects[0].marker.side_m: is missing"));
  EXPECT_THAT(MessageOf(R"({"objects": [{"name": "a", "shape": "box", "size_m": [1, 1, 1],
                "marker": {"family": "apriltag36h11", "id": 3, "side_m": 0}}]})"),
              HasSubstr("objects[0].marker.side_m: 0; give"));
  EXPECT_THAT(MessageOf(R"({"objects": [{"name": "a", "shape": "model", "model": "none.glb"}]})"),
              HasSubstr("none.glb"));
}

}  // namespace
}  // namespace saccade::scene_file_test
