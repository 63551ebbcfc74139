#include "server/sim/sim_truth.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/unit/server/sim/open_sim.hpp"

namespace saccade::sim_truth_test {
namespace {

TEST(SimTruth, OneLinePerFrameHandedOutWithPoseHeadAndObjects) {
  const std::unique_ptr<SimSource> source = OpenSim("desk?width=320&height=240", Frames(5));
  ASSERT_NE(source, nullptr);
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / "sim_truth_test.jsonl";
  ASSERT_TRUE(source->WriteTruthTo(file).ok());
  for (int k = 0; k < 2; ++k) ASSERT_TRUE(source->Next().ok());
  std::ifstream stream(file);
  std::string line;
  for (FrameId id = 5; id < 7; ++id) {
    ASSERT_TRUE(std::getline(stream, line));
    const nlohmann::json truth = nlohmann::json::parse(line);
    EXPECT_EQ(truth["frame"], id);
    EXPECT_EQ(truth["capture_time_ns"], static_cast<std::int64_t>(std::llround(id * 1e9 / 30)));
    const Rigid3 pose = source->WorldFromCamera(id);
    EXPECT_NEAR(truth["world_from_camera"]["translation_m"][2], pose.translation.z(), 1e-12);
    EXPECT_NEAR(truth["world_from_camera"]["rotation_xyzw"][3], pose.rotation.w(), 1e-12);
    EXPECT_EQ(truth["head"]["pan_rad"], 0.0);
    ASSERT_GE(truth["objects"].size(), 15u);
    int visible = 0;
    for (const auto& object : truth["objects"]) {
      EXPECT_TRUE(object["name"].is_string());
      EXPECT_EQ(object["point_in_world_m"].size(), 3u);
      if (!object["visible"]) continue;
      ++visible;
      EXPECT_GE(object["pixel"][0], 0.0);
      EXPECT_LE(object["pixel"][0], 319.0);
    }
    EXPECT_GE(visible, 6);
  }
  EXPECT_FALSE(std::getline(stream, line));
  std::filesystem::remove(file);
}

TEST(SimTruth, AFileThatCannotBeWrittenIsNamed) {
  const absl::Status status = SimTruthWriter::Open("/no/such/folder/truth.jsonl").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("/no/such/folder/truth.jsonl"));
}

}  // namespace
}  // namespace saccade::sim_truth_test
