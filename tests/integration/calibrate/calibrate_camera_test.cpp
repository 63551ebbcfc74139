// `saccade calibrate-camera` on photographs of boards that others took.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/integration/support/process.hpp"

namespace saccade::testing::calibrate_camera_test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

const fs::path kData = fs::path(SACCADE_SOURCE_DIR) / "../shared/data";

RunResult Calibrate(const std::string& source, const std::string& square, const std::string& out,
                    const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = {
      SACCADE_PROGRAM, "calibrate-camera", "--source", source,  "--board",
      "9x6",           "--square",         square,     "--out", out};
  words.insert(words.end(), more.begin(), more.end());
  return RunProgram(words, std::chrono::seconds(250));
}

std::string Read(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// OpenCV's own calibration of these pictures gave 535.9 in 2015, with a view 1.2 px off.
TEST(CalibrateCameraCommand, FindsTheLensOfOpenCvsPicturesAndWritesItForTheServer) {
  const fs::path pictures = kData / "markers/opencv_chessboard";
  if (!fs::exists(pictures)) GTEST_SKIP() << "no ../shared/data/markers here";
  const TemporaryFolder folder;
  for (const auto& entry : fs::directory_iterator(pictures)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("left") && name.ends_with(".jpg")) {
      fs::copy_file(entry.path(), folder / name);
    }
  }
  const TemporaryFolder results;
  const std::string source = "dataset:" + folder.path() + "?fps=1", out = results / "camera.yaml";
  const RunResult run = Calibrate(source, "0.025", out, {"--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto report = nlohmann::json::parse(run.out);
  const auto& fx = report["parameters"]["fx"];
  EXPECT_NEAR(fx["value"].get<double>(), 535.9, 3.0 * fx["sigma"].get<double>());
  EXPECT_LT(fx["sigma"].get<double>(), 5.0);
  EXPECT_LT(report["rms_px"].get<double>(), 0.3);
  EXPECT_THAT(run.err, HasSubstr("\"next\":"));
  EXPECT_THAT(Read(out), AllOf(HasSubstr("# Made by saccade "), HasSubstr("# one sigma: fx"),
                               HasSubstr("model: brown_conrady")));
  // It is a camera file of ours.
  const RunResult again = RunProgram(
      {SACCADE_PROGRAM, "record", "--source", source, "--camera", out, "--out", results / "set"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const RunResult twice = Calibrate(source, "0.025", out);
  EXPECT_EQ(twice.exit_code, 1);
  EXPECT_THAT(twice.err, HasSubstr("exists"));
}

// 300 pictures from one side of a desk: the board is never turned, only tilted.
TEST(CalibrateCameraCommand, RefusesARecordingThatDoesNotDetermineTheLens) {
  if (!fs::exists(kData / "checkerboard")) GTEST_SKIP() << "no ../shared/data/checkerboard here";
  const TemporaryFolder results;
  const RunResult run =
      Calibrate("dataset:" + (kData / "checkerboard").string(), "0.04", results / "camera.yaml");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("hardly turned to the left or right"));
  EXPECT_THAT(run.err, HasSubstr("tilt it by 30 degrees"));
  EXPECT_FALSE(fs::exists(results / "camera.yaml"));
}

TEST(CalibrateCameraCommand, SaysWhatIsWrongWithTheBoard) {
  const TemporaryFolder results;
  const RunResult run = Calibrate("sim:desk?duration=0.2", "25", results / "camera.yaml");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("--square: 25"));
  const RunResult other = RunProgram({SACCADE_PROGRAM, "calibrate-camera", "--source",
                                      "sim:desk?duration=0.2&width=320&height=240", "--board",
                                      "13x12", "--square", "0.03", "--out", results / "a.yaml"},
                                     std::chrono::seconds(60));
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("seen whole in 0 views"));
}

}  // namespace
}  // namespace saccade::testing::calibrate_camera_test
