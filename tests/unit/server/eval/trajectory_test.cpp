#include "server/eval/trajectory.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <random>

namespace saccade::trajectory_test {
namespace {

std::filesystem::path Write(const std::string& text) {
  static const std::filesystem::path file =
      std::filesystem::temp_directory_path() /
      ("saccade-trajectory-" + std::to_string(::getpid()) + ".tum");
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

TEST(Trajectory, ALineReadsBackAsWritten) {
  const Rigid3 pose = {ExpQuaternion({0.3, -0.7, 1.9}), {1.25, -3.5, 0.001}};
  const auto file = Write("# comment\n\n" + TumLine("1305031102.175304", pose));
  const auto read = LoadTrajectory(file);
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), 1);
  EXPECT_EQ(read->at(0).time_ns, 1305031102175304000);
  EXPECT_LT((read->at(0).world_from_camera.translation - pose.translation).norm(), 1e-9);
  EXPECT_LT(RotationAngle(read->at(0).world_from_camera, pose), 1e-8);
}

TEST(Trajectory, ErrorsNameTheLine) {
  const auto error = [](const std::string& text) {
    return std::string(LoadTrajectory(Write(text)).status().message());
  };
  EXPECT_NE(error("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0\n").find(".tum:2: has 7 fields"), error("").npos);
  EXPECT_NE(error("1 0 0 nan 0 0 0 1\n").find(":1: field 4"), error("").npos);
  EXPECT_NE(error("1 0 0 0 0 0 0 2\n").find("length 2"), error("").npos);
  EXPECT_NE(error("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").find(":2: the time"), error("").npos);
  EXPECT_EQ(LoadTrajectory("/nowhere/x.tum").status().code(), absl::StatusCode::kNotFound);
}

TEST(Trajectory, DamagedFilesAreRefusedOrReadButNeverCrash) {
  std::string good;
  for (int i = 0; i < 5; ++i) good += TumLine(std::to_string(i) + ".5", {});
  std::mt19937 rng(9);
  int refused = 0;
  for (int round = 0; round < 500; ++round) {
    std::string text = good;
    for (int edit = 0; edit < 3; ++edit) text[rng() % text.size()] = static_cast<char>(rng());
    refused += LoadTrajectory(Write(text)).ok() ? 0 : 1;
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace saccade::trajectory_test
