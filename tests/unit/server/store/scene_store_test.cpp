#include "server/store/scene_store.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

namespace saccade {
namespace {

class SceneStoreTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              ("scene_store_test-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  std::unique_ptr<SceneStore> Open() const {
    absl::StatusOr<std::unique_ptr<SceneStore>> store = SceneStore::Open(folder_);
    EXPECT_TRUE(store.ok()) << store.status();
    return *std::move(store);
  }
  std::filesystem::path folder_;
};

TEST_F(SceneStoreTest, WhatIsPutIsFoundAtTheNextStart) {
  SceneObject shelf;
  shelf.id = "b";
  shelf.name = "a \"shelf\"";
  shelf.shape = SceneShape::kModel;
  shelf.material = SceneMaterial::kVirtual;
  shelf.model = "m";
  shelf.scale = 2.5;
  shelf.parent_from_object = {ExpQuaternion({0.1, 0.2, 0.3}), {1, 2, 3}};
  SceneObject wall;
  wall.id = "a";
  wall.name = "wall";
  wall.size_m = {1, 2, 3};
  {
    const auto store = Open();
    ASSERT_TRUE(store->PutObject(shelf).ok());
    ASSERT_TRUE(store->PutObject(wall).ok());
    ASSERT_TRUE(store->PutModel({"m", "part", std::string("\0glb", 4)}).ok());
    wall.size_m.x() = 1.5;
    ASSERT_TRUE(store->PutObject(wall).ok());
  }
  {
    const auto store = Open();
    const absl::StatusOr<SceneStore::Stored> stored = store->LoadAll();
    ASSERT_TRUE(stored.ok()) << stored.status();
    ASSERT_EQ(stored->objects.size(), 2u);
    EXPECT_EQ(stored->objects[0].size_m, wall.size_m);
    const SceneObject& read = stored->objects[1];
    EXPECT_EQ(read.name, shelf.name);
    EXPECT_EQ(read.model, "m");
    EXPECT_EQ(read.scale, 2.5);
    EXPECT_LT(RotationAngle(read.parent_from_object, shelf.parent_from_object), 1e-12);
    ASSERT_EQ(stored->models.size(), 1u);
    EXPECT_EQ(stored->models[0].bytes, std::string("\0glb", 4));
    ASSERT_TRUE(store->RemoveObject("a").ok());
  }
  EXPECT_EQ(Open()->LoadAll()->objects.size(), 1u);
}

}  // namespace
}  // namespace saccade
