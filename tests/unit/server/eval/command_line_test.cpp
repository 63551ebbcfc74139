// Runs the program itself: exit codes, files, one-line errors.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace {

struct Result {
  int exit_code = -1;
  std::string out, err;
};

class SaccadeEval : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string Read(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  Result Run(const std::string& arguments) const {
    const std::string command = std::string(SACCADE_EVAL) + " " + arguments + " >" +
                                (folder_ / "out").string() + " 2>" + (folder_ / "err").string();
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, Read(folder_ / "out"),
            Read(folder_ / "err")};
  }
  static std::ptrdiff_t Lines(const std::string& text) {
    return std::count(text.begin(), text.end(), '\n');
  }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("saccade-eval-" + std::to_string(::getpid()));
};

TEST_F(SaccadeEval, BadUsageExitsWithTwoAndOneLine) {
  for (const char* arguments :
       {"", "dance", "run", "run --dataset x",
        "score --estimate a --truth b "
        "--align none",
        "sim --scenario points --runs 0 --out x", "run --dataset x --out y --every 0"}) {
    const Result result = Run(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_EQ(Lines(result.err), 1) << result.err;
  }
  EXPECT_EQ(Run("--help").exit_code, 0);
  EXPECT_EQ(Run("--version").exit_code, 0);
}

TEST_F(SaccadeEval, FailureExitsWithOneAndNamesTheThing) {
  const auto fails = [&](const std::string& arguments, const std::string& words) {
    const Result result = Run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_EQ(Lines(result.err), 1) << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
  };
  fails("run --dataset /nowhere --out /tmp/x", "/nowhere: no such folder");
  fails("run --dataset /nowhere --out /tmp/x --frames 5:2", "--frames '5:2'");
  fails("run --dataset /nowhere --out /tmp/x --drop 5:2", "--drop '5:2'");
  fails("run --dataset /nowhere --out /tmp/x --freeze 5", "--freeze '5'");
  fails("score --estimate /nowhere.tum --truth /nowhere.tum", "/nowhere.tum: cannot be opened");
  fails("sim --scenario dance --out /tmp/x", "'dance' is unknown; use one of points");
}

TEST_F(SaccadeEval, ScorePrintsJson) {
  std::ofstream file(folder_ / "a.tum");
  for (int i = 0; i < 60; ++i) {
    file << 0.05 * i + 1 << " " << 0.01 * i * i << " " << 0.1 * i << " 0 0 0 0 1\n";
  }
  file.close();
  const std::string path = (folder_ / "a.tum").string();
  const Result result = Run("score --estimate " + path + " --truth " + path + " --align sim3");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto report = nlohmann::json::parse(result.out);
  EXPECT_LT(report["ate_m"].get<double>(), 1e-9);
  EXPECT_GT(report["ate_null_m"].get<double>(), 1.0);
  EXPECT_NEAR(report["scale"].get<double>(), 1.0, 1e-9);
}

TEST_F(SaccadeEval, PointsScenarioIsTheSameTwice) {
  for (const char* name : {"a", "b"}) {
    const Result result =
        Run("sim --scenario points --runs 2 --duration 3 --out " + (folder_ / name).string());
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  EXPECT_EQ(Read(folder_ / "a" / "report.json"), Read(folder_ / "b" / "report.json"));
  for (const char* file : {"trajectory.tum", "groundtruth.txt", "consistency.csv"}) {
    const std::string a = Read(folder_ / "a" / "run-001" / file);
    EXPECT_FALSE(a.empty()) << file;
    EXPECT_EQ(a, Read(folder_ / "b" / "run-001" / file)) << file;
  }
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a" / "run-000" / "frames.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a" / "run-000" / "anchors.csv"));
}

TEST_F(SaccadeEval, RecordWritesARecordingThatRuns) {
  const std::filesystem::path recording = folder_ / "recording";
  const Result written = Run(
      "record --source 'sim:desk?seed=3&motion=twist' --frames 10:70 --out " + recording.string());
  ASSERT_EQ(written.exit_code, 0) << written.err;
  EXPECT_EQ(Lines(Read(recording / "rgb.txt")), 60);
  EXPECT_EQ(Lines(Read(recording / "groundtruth.txt")), 60);
  EXPECT_EQ(Read(recording / "rgb.txt").find("0.333333 rgb/0.333333.png\n"), 0u) << "frame 10";
  const Result run =
      Run("run --dataset " + recording.string() + " --json --out " + (folder_ / "run").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto report = nlohmann::json::parse(run.out);
  EXPECT_EQ(report["frames"].get<int>(), 60);
  // It hardly does more than turn: until the scale is held it is initialising, and never lost.
  EXPECT_GT(report["tracked_frames"].get<int>(), 10);
  EXPECT_EQ(report["tracked_frames"].get<int>() + report["initialising_frames"].get<int>(), 60);
  EXPECT_LT(report["ate_sim3_m"].get<double>(), 0.01);

  const Result thinned =
      Run("run --dataset " + recording.string() +
          " --drop 20:30 --every 2 --freeze 40:0.2 --json --out " + (folder_ / "thinned").string());
  ASSERT_EQ(thinned.exit_code, 0) << thinned.err;
  EXPECT_EQ(nlohmann::json::parse(thinned.out)["frames"].get<int>(), 25);
  const Result nothing = Run("run --dataset " + recording.string() + " --drop : --out " +
                             (folder_ / "nothing").string());
  EXPECT_EQ(nothing.exit_code, 1);
  EXPECT_NE(nothing.err.find("no frame is left"), std::string::npos) << nothing.err;

  const Result refused = Run("record --source sim:desk --frames 0:2 --out /proc/nowhere");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("/proc/nowhere"), std::string::npos) << refused.err;
}

TEST_F(SaccadeEval, RecordingRunsTheSameTwiceAndHalfIsThePrefix) {
  const std::string data = SACCADE_SOURCE_DIR "/../shared/data/checkerboard";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "checkerboard is not in ../shared/data";
  const auto run = [&](const char* name, const char* frames) {
    const Result result = Run("run --dataset " + data + " --frames " + frames + " --out " +
                              (folder_ / name).string());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Read(folder_ / name / "trajectory.tum");
  };
  const std::string whole = run("a", "0:80"), again = run("b", "0:80"), half = run("c", "0:40");
  EXPECT_EQ(whole, again);
  ASSERT_FALSE(half.empty());
  EXPECT_EQ(whole.substr(0, half.size()), half);
  const auto report = nlohmann::json::parse(Read(folder_ / "a" / "report.json"));
  const auto count = [&](const char* key) { return report.at(key).get<int>(); };
  EXPECT_EQ(count("initialising_frames") + count("tracked_frames") + count("coasting_frames") +
                count("lost_frames"),
            count("frames"));
  EXPECT_EQ(count("frames"), 80);
  for (const char* key : {"bad_frames", "metric", "features", "frame_ms", "stage_ms", "ate_se3_m",
                          "ate_sim3_m", "ate_null_m", "scale", "rpe_1s_m", "rpe_1s_deg",
                          "scale_windows", "false_tracked_frames", "lost_after_start_frames"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
}

}  // namespace
