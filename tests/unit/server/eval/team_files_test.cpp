// What `saccade-eval team` reads: small recordings, and what is wrong with others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "server/eval/team/mrclam_run.hpp"
#include "server/eval/team/wand_files.hpp"

namespace saccade::team_files_test {
namespace {

using Files = std::map<std::string, std::string>;

class TeamFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("team_files_" + std::to_string(::getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  /// `files` with what `changed` says instead; an empty text leaves a file out.
  void Write(Files files, const Files& changed) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    for (const auto& [name, text] : changed) files[name] = text;
    for (const auto& [name, text] : files) {
      if (!text.empty()) std::ofstream(folder_ / name) << text;
    }
  }
  std::filesystem::path folder_;
};

Files Robots() {
  return {{"Barcodes.dat", "# subject code\n1 5\n2 14\n6 63\n"},
          {"Landmark_Groundtruth.dat", "6 2.0 1.0 0.001 0.001\n"},
          {"Robot1_Odometry.dat", "100.0 0.1 0.0\n101.0 0.1 0.2\n104.0 0 0\n"},
          {"Robot1_Measurement.dat", "100.5 63 2.2 0.45\n101.5 14 1.0 0.0\n102.0 99 1.0 0.0\n"},
          {"Robot1_Groundtruth.dat", "99.9 0 0 0\n100.1 0 0 0\n100.2 0.02 0 6.28318530718\n"},
          {"Robot2_Odometry.dat", "100.0 0.0 0.0\n104.0 0 0\n"},
          {"Robot2_Measurement.dat", "100.7 5 1.0 3.1\n"},
          {"Robot2_Groundtruth.dat", "99.9 1 0 0\n100.1 1 0 0\n"}};
}

TEST_F(TeamFiles, RobotsOfMrclamAreRunAndScored) {
  Write(Robots(), {});
  const auto data = LoadMrclam(folder_);
  ASSERT_TRUE(data.ok()) << data.status();
  ASSERT_EQ(data->robots.size(), 2u);
  EXPECT_EQ(data->unknown_codes, 1u);
  EXPECT_EQ(data->robots[0].sights[0].subject, 6);
  EXPECT_EQ(data->robots[0].sights[1].subject, 2);
  EXPECT_NEAR(TruthAt(data->robots[0].truth, 100'150'000'000)->z(), 0.0, 1e-6) << "not half a turn";
  EXPECT_FALSE(TruthAt(data->robots[0].truth, 100'200'000'001));
  const auto result = RunMrclam(*data, TeamSettings());
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->counts.landmarks, 1u);
  EXPECT_EQ(result->counts.mutual, 2u);
  EXPECT_EQ(result->robots[0].size(), 40u) << "four seconds, ten a second";
  EXPECT_NEAR(result->robots[0].back().belief.state[kX], 0.37, 0.1);
  EXPECT_EQ(ScoreMrclam(result->robots[0], data->robots[0].truth).compared, 2u);
  // Away, and back where nothing shows where.
  const auto settings = ParseTeamSettings({"team.away=2:1:2", "team.mode=separate"});
  ASSERT_TRUE(settings.ok()) << settings.status();
  const auto away = RunMrclam(*data, *settings);
  ASSERT_TRUE(away.ok());
  EXPECT_EQ(away->robots[1].size(), 10u);
  EXPECT_EQ(away->counts.mutual, 0u);
}

TEST_F(TeamFiles, SaysWhichLineOfMrclamIsWrong) {
  const std::pair<Files, const char*> cases[] = {
      {{{"Barcodes.dat", ""}}, "Barcodes.dat"},
      {{{"Barcodes.dat", "1 5\n2 5\n"}}, "Barcodes.dat, line 2: its subject or bar code was given"},
      {{{"Barcodes.dat", "1 five\n"}}, "Barcodes.dat, line 1: 'five' is not a finite number"},
      {{{"Barcodes.dat", "1 5 6\n"}}, "line 1: has 3 numbers, not 2"},
      {{{"Barcodes.dat", "# nothing\n"}}, "has no line of numbers"},
      {{{"Barcodes.dat", "1.5 5\n"}}, "subject 1.5 is not a whole number"},
      {{{"Landmark_Groundtruth.dat", "6 1 2 0 0\n6 1 2 0 0\n"}}, "landmark 6 was given before"},
      {{{"Landmark_Groundtruth.dat", "2 1 2 0 0\n"}}, "subject 2 is a robot"},
      {{{"Robot1_Odometry.dat", ""}}, "Robot1_Odometry.dat"},
      {{{"Robot1_Odometry.dat", "100 1 1\n99 1 1\n"}}, "Robot1_Odometry.dat, line 2: its time"},
      {{{"Robot1_Odometry.dat", "100 nan 1\n"}}, "line 1: 'nan' is not a finite number"},
      {{{"Robot2_Measurement.dat", "100 5 -1 0\n"}}, "Robot2_Measurement.dat, line 1: range -1 m"},
      {{{"Robot2_Measurement.dat", ""}}, "Robot2_Measurement.dat"},
      {{{"Robot2_Groundtruth.dat", "100 5 -1\n"}}, "Robot2_Groundtruth.dat, line 1: has 3 numbers"},
  };
  for (const auto& [changed, message] : cases) {
    Write(Robots(), changed);
    const auto data = LoadMrclam(folder_);
    ASSERT_FALSE(data.ok()) << message;
    EXPECT_THAT(std::string(data.status().message()), ::testing::HasSubstr(message));
  }
  for (const char* set : {"team.mode=both", "team.away=3", "team.away=0:1:2", "team.away=1:2:1",
                          "team.nothing=1", "mode=joint", "team.loss=2", "team.rate_hz=x"}) {
    EXPECT_FALSE(ParseTeamSettings({set}).ok()) << set;
  }
}

Files Wand() {
  return {{"cameras.yaml",
           "cam0: {camera_model: pinhole, distortion_coeffs: [0, 0, 0, 0, 0], distortion_model: "
           "plumb_bob, intrinsics: [500, 500, 320, 240], resolution: [640, 480]}\n"},
          {"wand_tags.csv", "# tag side 0.12 m, corners\n0,0,0,0,0,0,0\n1,0.2,0,0,0,0,1.57\n"},
          {"detections.csv",
           "10.5,0,0,1,2,3,4,5,6,7,8\n10.5,0,1,1,2,3,4,5,6,7,8\n"
           "11,0,9,1,2,3,4,5,6,7,8\n11,0,1,1,2,3,4,5,6,7,8\n"}};
}

TEST_F(TeamFiles, SaysWhichLineOfAWandsFilesIsWrong) {
  Write(Wand(), {});
  const auto data = LoadWand(folder_, 0.0);
  ASSERT_TRUE(data.ok()) << data.status();
  EXPECT_EQ(data->body.side_m, 0.12);
  EXPECT_EQ(data->times_ns.size(), 2u);
  ASSERT_EQ(data->sights.size(), 3u) << "a tag of somebody else is passed over";
  EXPECT_EQ(data->sights[2].instant, 1);
  EXPECT_EQ(data->sights[2].corners[3].y(), 8.0);
  EXPECT_EQ(LoadWand(folder_, 0.3)->body.side_m, 0.3);
  const std::pair<Files, const char*> cases[] = {
      {{{"cameras.yaml", ""}}, "cameras.yaml"},
      {{{"cameras.yaml", "cam1: {camera_model: pinhole}\n"}}, "cam0 is missing"},
      {{{"cameras.yaml", "cam0: {camera_model: omni}\n"}}, "camera_model"},
      {{{"cameras.yaml",
         "cam0: {camera_model: pinhole, distortion_coeffs: [0, 0, 0], distortion_model: plumb_bob, "
         "intrinsics: [500, 500, 320, 240], resolution: [640, 480]}\n"}},
       "distortion_coeffs"},
      {{{"cameras.yaml",
         "cam0: {camera_model: pinhole, distortion_coeffs: [0, 0, 0, 0], distortion_model: "
         "plumb_bob, intrinsics: [0, 500, 320, 240], resolution: [640, 480]}\n"}},
       "intrinsics"},
      {{{"wand_tags.csv", "0,0,0,0,0,0,0\n"}}, "add a line `# tag side 0.12 m`"},
      {{{"wand_tags.csv", "# tag side 0.1 m\n0,0,0\n"}}, "wand_tags.csv, line 2: has 3 numbers"},
      {{{"wand_tags.csv", "# tag side 0.1 m\n0,0,0,0,0,0,0\n0,0,0,0,0,0,0\n"}}, "given before"},
      {{{"detections.csv", "10,1,0,1,2,3,4,5,6,7,8\n"}}, "line 1: camera 1 is not in cameras.yaml"},
      {{{"detections.csv", "10,0,0,1,2,3,4,5,6,7,8\n9,0,0,1,2,3,4,5,6,7,8\n"}}, "line 2: its time"},
      {{{"detections.csv", "10,0,7,1,2,3,4,5,6,7,8\n"}}, "none of its tags is in wand_tags.csv"},
      {{{"detections.csv", "10,0,0,1,2,3,4,5,6,7\n"}}, "line 1: has 10 numbers, not 11"},
      {{{"reference_cameras.csv", "0,1\n"}}, "reference_cameras.csv, line 1"},
      {{{"reference_wand.tum", "0 1\n"}}, "reference_wand.tum"},
  };
  for (const auto& [changed, message] : cases) {
    Write(Wand(), changed);
    const auto bad = LoadWand(folder_, 0.0);
    ASSERT_FALSE(bad.ok()) << message;
    EXPECT_THAT(std::string(bad.status().message()), ::testing::HasSubstr(message));
  }
}

}  // namespace
}  // namespace saccade::team_files_test
