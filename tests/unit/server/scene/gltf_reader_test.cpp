#include "shared/models/gltf_reader.hpp"

#include <absl/strings/match.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "shared/models/glb_writer.hpp"
#include "shared/models/shapes.hpp"
#include "tests/unit/server/scene/glb_builder.hpp"

namespace saccade::gltf_reader_test {
namespace {

using ::testing::HasSubstr;

std::string MessageOf(const std::string& bytes) {
  const absl::StatusOr<TriangleMesh> mesh = ReadGlb(bytes);
  return mesh.ok() ? "read" : std::string(mesh.status().message());
}

TEST(ReadGlb, TurnsGltfsFrameIntoOurs) {
  const absl::StatusOr<TriangleMesh> mesh = ReadGlb(GlbBuilder::Triangle().Bytes());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->triangles.size(), 1u);
  EXPECT_EQ(mesh->positions[2], Eigen::Vector3f(0, -2, -0.5f));  // up is -y, to the viewer -z
  // A half turn about x: outside stays outside.
  EXPECT_EQ(mesh->triangles[0], (TriangleMesh::Triangle{0, 1, 2}));
}

TEST(ReadGlb, ReadsWhatWriteGlbWrote) {
  TriangleMesh mesh = BoxMesh({0.3, 0.2, 0.1}, 0x2bb16cff);
  Append(PlaneMesh(1, 2, 0x10203080), {Eigen::Quaterniond::Identity(), {0, -1, 3}}, 1, mesh);
  const absl::StatusOr<TriangleMesh> read = ReadGlb(*WriteGlb(mesh));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->triangles.size(), mesh.triangles.size());
  const std::size_t plane = 2;  // of triangles; its colour is the lower number
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::size_t j = (i + plane) % mesh.triangles.size();
    EXPECT_EQ(read->colors_rgba[j], mesh.colors_rgba[i]);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(read->positions[read->triangles[j][k]], mesh.positions[mesh.triangles[i][k]]);
    }
  }
}

TEST(ReadGlb, AppliesTheTransformsOfNodesAndColours) {
  GlbBuilder glb = GlbBuilder::Triangle();
  glb.root["nodes"] = {{{"children", {1}}, {"translation", {10, 0, 0}}},
                       {{"mesh", 0}, {"scale", {-2, 1, 1}}}};
  glb.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0, 0, 1}}}}}};
  glb.root["meshes"][0]["primitives"][0]["material"] = 0;
  const absl::StatusOr<TriangleMesh> mesh = ReadGlb(glb.Bytes());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->positions[1], Eigen::Vector3f(8, 0, 0));
  EXPECT_EQ(mesh->triangles[0], (TriangleMesh::Triangle{0, 2, 1}));  // mirrored: turned over
  EXPECT_EQ(mesh->colors_rgba[0], 0xff0000ffu);
}

TEST(WriteGlb, WhatIsWrittenIsReadBackWithItsColours) {
  GlbPart red;
  red.name = "shelf";
  red.positions = {{0, 0, 1}, {1, 0, 1}, {0, 2, 1}};
  red.triangles = {0, 1, 2};
  red.color_rgba = 0xbc000080;
  GlbPart coloured = red;
  coloured.name = "surfaces";
  coloured.colors_rgba = {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255};
  GlbPart line;
  line.positions = {{0, 0, 0}, {0, 0, 3}};
  line.lines = {0, 1};
  const absl::StatusOr<std::string> bytes = WriteGlb({red, coloured, line, GlbPart()});
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(bytes->substr(0, 4), "glTF");
  const absl::StatusOr<TriangleMesh> mesh = ReadGlb(*bytes);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->triangles.size(), 2u);  // lines have none
  EXPECT_LT((mesh->positions[2] - Eigen::Vector3f(0, 2, 1)).norm(), 1e-6f);
  EXPECT_EQ(mesh->triangles[0], (TriangleMesh::Triangle{0, 1, 2}));
  EXPECT_FALSE(WriteGlb(std::vector<GlbPart>()).ok());
}

TEST(ReadGlb, TornAtAnyByteIsRefused) {
  const std::string whole = GlbBuilder::Triangle().Bytes();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(ReadGlb(whole.substr(0, size)).ok()) << size;
  }
  EXPECT_THAT(MessageOf(whole.substr(0, whole.size() - 4)), HasSubstr("torn"));
  EXPECT_THAT(MessageOf("solid cube"), HasSubstr("not a GLB file"));
}

TEST(ReadGlb, DamagedAnywhereNeverCrashes) {
  const std::string whole = GlbBuilder::Triangle().Bytes();
  std::mt19937 random(3);
  for (int i = 0; i < 3000; ++i) {
    std::string bytes = whole;
    for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    const absl::StatusOr<TriangleMesh> mesh = ReadGlb(bytes);
    EXPECT_TRUE(mesh.ok() || absl::StartsWith(mesh.status().message(), "model: ")) << mesh.status();
  }
}

TEST(ReadGlb, TwoMillionTrianglesAreRefusedBeforeTheyAreRead) {
  GlbBuilder glb = GlbBuilder::Triangle();
  glb.root["accessors"][1]["count"] = 6'000'000;
  const absl::StatusOr<TriangleMesh> mesh = ReadGlb(glb.Bytes());
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(mesh.status().message()), HasSubstr("2000000"));
  EXPECT_THAT(std::string(mesh.status().message()), HasSubstr("simplify"));
}

TEST(ReadGlb, ASmallFileThatAsksForManyCopiesIsRefused) {
  GlbBuilder glb = GlbBuilder::Triangle();
  nlohmann::json children = nlohmann::json::array();
  for (int i = 0; i < 9000; ++i) {
    glb.root["nodes"].push_back({{"mesh", 0}});
    children.push_back(i + 1);
  }
  glb.root["nodes"][0] = {{"children", children}};
  EXPECT_TRUE(ReadGlb(glb.Bytes()).ok());
  EXPECT_EQ(ReadGlb(glb.Bytes(), {.triangles = 8999}).status().code(),
            absl::StatusCode::kResourceExhausted);
}

TEST(ReadGlb, EachProblemIsNamed) {
  GlbBuilder nan =
      GlbBuilder::Of({0, 0, 0, 1, 0, 0, 0, std::numeric_limits<float>::quiet_NaN(), 0}, {0, 1, 2});
  EXPECT_THAT(MessageOf(nan.Bytes()), HasSubstr("vertex 2 is not a finite number"));

  GlbBuilder no_buffer = GlbBuilder::Triangle();
  no_buffer.root["bufferViews"][0]["buffer"] = 7;
  EXPECT_THAT(MessageOf(no_buffer.Bytes()), HasSubstr("positions: its buffer is missing"));

  GlbBuilder no_binary = GlbBuilder::Triangle();
  no_binary.binary.clear();
  EXPECT_THAT(MessageOf(no_binary.Bytes()), HasSubstr("cannot be read"));

  GlbBuilder beyond = GlbBuilder::Triangle();
  beyond.root["accessors"][0]["count"] = 4;
  EXPECT_THAT(MessageOf(beyond.Bytes()), HasSubstr("beyond the buffer"));

  GlbBuilder wrong_index = GlbBuilder::Of({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 3});
  EXPECT_THAT(MessageOf(wrong_index.Bytes()), HasSubstr("vertex 3 of 3"));

  GlbBuilder outside = GlbBuilder::Triangle();
  outside.root["buffers"][0]["uri"] = "/etc/passwd";
  EXPECT_THAT(MessageOf(outside.Bytes()), HasSubstr("files beside it"));

  GlbBuilder packed = GlbBuilder::Triangle();
  packed.root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  EXPECT_THAT(MessageOf(packed.Bytes()), HasSubstr("KHR_draco_mesh_compression"));

  GlbBuilder circle = GlbBuilder::Triangle();
  circle.root["nodes"][0]["children"] = {0};
  EXPECT_THAT(MessageOf(circle.Bytes()), HasSubstr("circle"));

  GlbBuilder lines = GlbBuilder::Triangle();
  lines.root["meshes"][0]["primitives"][0]["mode"] = 1;
  EXPECT_THAT(MessageOf(lines.Bytes()), HasSubstr("no triangles"));
}

}  // namespace
}  // namespace saccade::gltf_reader_test
