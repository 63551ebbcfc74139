#include "server/store/scene_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace saccade::scene_store_test {
namespace {

class SceneStoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("scene_store_test_" + std::to_string(getpid()));
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

SceneObject Box(int number) {
  SceneObject box;
  box.id = "id-" + std::to_string(number);
  box.name = std::string(90, 'x');
  return box;
}

/// Fills it until it refuses; what it accepted is there, then and after the next start.
void FillUntilRefused(const std::filesystem::path& folder) {
  std::size_t objects = 0, models = 0;
  {
    const auto store = SceneStore::Open(folder);
    ASSERT_TRUE(store.ok()) << store.status();
    absl::Status refused;
    for (int k = 0; k < 2000 && refused.ok(); ++k) {
      refused = (*store)->PutObject(Box(k));
      objects += refused.ok() ? 1 : 0;
      if (!refused.ok()) break;
      refused = (*store)->PutModel({"m" + std::to_string(k), "part", std::string(20'000, 'g')});
      models += refused.ok() ? 1 : 0;
    }
    EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
    EXPECT_THAT(std::string(refused.message()), ::testing::HasSubstr("scene.sqlite"));
    EXPECT_THAT(std::string(refused.message()), ::testing::HasSubstr("make room"));
    const auto stored = (*store)->LoadAll();
    ASSERT_TRUE(stored.ok()) << stored.status();
    EXPECT_EQ(stored->objects.size(), objects);
    EXPECT_EQ(stored->models.size(), models);
  }
  EXPECT_GT(models, 2u);
  const auto again = SceneStore::Open(folder);
  if (!again.ok()) {  // not even its index fits: in words
    EXPECT_EQ(again.status().code(), absl::StatusCode::kResourceExhausted) << again.status();
    return;
  }
  const auto stored = (*again)->LoadAll();
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->objects.size(), objects);
  EXPECT_EQ(stored->models.size(), models);
}

TEST_F(SceneStoreTest, AFullDiskIsNamedAndLosesNothingAccepted) {
  if (geteuid() != 0 || mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=512k") != 0) {
    GTEST_SKIP() << "needs the right to mount a tmpfs";
  }
  FillUntilRefused(folder_);
  umount(folder_.c_str());
}

TEST_F(SceneStoreTest, TornOrForeignFilesAreRefusedInWords) {
  {
    const auto store = Open();
    for (int k = 0; k < 300; ++k) ASSERT_TRUE(store->PutObject(Box(k)).ok());
  }
  const std::filesystem::path file = folder_ / "scene.sqlite";
  const auto size = std::filesystem::file_size(file);
  std::filesystem::copy_file(file, folder_ / "whole");
  const auto refused = [&](const char* what) {
    const auto opened = SceneStore::Open(folder_);
    const absl::Status status = opened.ok() ? (*opened)->LoadAll().status() : opened.status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << what << ": " << status;
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("scene.sqlite")) << what;
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("move")) << what;
    std::filesystem::copy_file(folder_ / "whole", file,
                               std::filesystem::copy_options::overwrite_existing);
  };
  std::filesystem::resize_file(file, size / 2);
  refused("torn");
  {
    std::fstream raw(file, std::ios::in | std::ios::out | std::ios::binary);
    for (int page = 1; page < 6; ++page) raw.seekp(4096 * page) << std::string(4096, '\xee');
  }
  refused("damaged inside");
  std::ofstream(file) << std::string(8192, 'x');
  refused("no database");
  EXPECT_EQ(Open()->LoadAll()->objects.size(), 300u);  // the whole one, put back
}

}  // namespace
}  // namespace saccade::scene_store_test
