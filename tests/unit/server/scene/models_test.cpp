// The models that ship (deploy/models).
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "server/scene/placement.hpp"
#include "server/scene/scene_file.hpp"
#include "shared/models/shapes.hpp"

namespace saccade::models_test {
namespace {

const std::filesystem::path kFolder = SACCADE_SOURCE_DIR "/deploy/models";

std::string Bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class ShippedModel : public ::testing::TestWithParam<const char*> {
 protected:
  std::shared_ptr<const SceneModel> Model() const {
    const std::string name = GetParam();
    auto model = MakeModel(name, name, Bytes(kFolder / (name + ".glb")));
    EXPECT_TRUE(model.ok()) << model.status();
    return model.ok() ? *model : nullptr;
  }
};

TEST_P(ShippedModel, StandsOnItsBaseAndIsClosed) {
  const auto model = Model();
  ASSERT_NE(model, nullptr);
  EXPECT_TRUE(IsClosed(model->mesh));
  Eigen::Vector3f low = Eigen::Vector3f::Constant(9), high = -low;
  double volume = 0;
  for (const TriangleMesh::Triangle& t : model->mesh.triangles) {
    const Eigen::Vector3f &a = model->mesh.positions[t[0]], &b = model->mesh.positions[t[1]],
                          &c = model->mesh.positions[t[2]];
    volume += static_cast<double>(a.dot(b.cross(c))) / 6.0;
    for (const Eigen::Vector3f& p : {a, b, c}) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  EXPECT_GT(volume, 0);  // seen from outside
  EXPECT_NEAR(high.y(), 0, 1e-6);
  EXPECT_NEAR(low.x() + high.x(), 0, 0.02);
  EXPECT_LT(high.x() - low.x(), 2);
  EXPECT_LT(-low.y(), 2);
}

TEST_P(ShippedModel, IsPushedToTheWallAndSinksToTheFloor) {
  const auto model = Model();
  ASSERT_NE(model, nullptr);
  const CollisionScene scene({{"room", "room", RoomMesh({4, 2.5, 4}, 0)}});
  PlacementRequest request;
  request.world_from_body.translation = {0, -0.3, 0};
  request.push = Eigen::Vector3d(0, 0, 1);
  const auto placed = Place(scene, Body(model->mesh), request);
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_NEAR(placed->world_from_body.translation.y(), -kContactGap_m, 1e-6);
  EXPECT_NEAR(placed->stop->normal_in_world.z(), -1, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedModel,
                         ::testing::Values("shelf", "desk", "pipe", "valve", "crate", "arrow",
                                           "divider", "person", "inside"));

TEST(ShippedModels, AreWhatTheScriptWrites) {
  const std::filesystem::path out = std::filesystem::path(::testing::TempDir()) /
                                    ("shipped_models-" + std::to_string(::getpid()));
  const std::string command = (kFolder / "generate").string() + " " + out.string();
  ASSERT_EQ(std::system(command.c_str()), 0) << "python3 is missing? deploy/install brings it";
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    if (entry.path().extension() != ".glb") continue;
    ++files;
    EXPECT_EQ(Bytes(entry.path()), Bytes(out / entry.path().filename())) << entry.path();
  }
  EXPECT_EQ(files, 9);
}

}  // namespace
}  // namespace saccade::models_test
