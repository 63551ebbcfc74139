// The whole server while its decoder is killed again and again: frames go on.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>

#include "tests/integration/support/process.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::decoder_killed_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kFrames = 290, kKills = 20;

/// The decoder of a server, by the kernel's list of its children; 0: none just now.
pid_t DecoderOf(pid_t server) {
  std::error_code error;
  const std::string tasks = "/proc/" + std::to_string(server) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks, error)) {
    std::ifstream children(task.path() / "children");
    for (pid_t child = 0; children >> child;) {
      std::ifstream name("/proc/" + std::to_string(child) + "/comm");
      std::string words;
      std::getline(name, words);
      if (words == "saccade-decode") return child;
    }
  }
  return 0;
}

TEST(DecoderKilled, TwentyTimesNoFrameOfTheServerIsASecondLate) {
  TemporaryFolder folder;
  WriteSmallDataset(folder / "set", {.frames = kFrames});
  const RunResult made =
      RunProgram({"/usr/bin/ffmpeg", "-v", "error", "-framerate", "30", "-pattern_type", "glob",
                  "-i", folder / "set/rgb/*.png", "-c:v", "libx264", "-preset", "veryfast", "-g",
                  "60", folder / "set.mp4"},
                 seconds(60));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  Server server({"--source", "file:" + (folder / "set.mp4"), "--camera", folder / "set/camera.yaml",
                 "--data-dir", folder / "data"});
  Process watch({SACCADE_PROGRAM, "--server", server.grpc(), "watch", "--json"});
  ASSERT_TRUE(watch.WaitForLine("frame_id", seconds(20))) << watch.err();
  int kills = 0;
  for (int i = 0; i < 200 && kills < kKills; ++i) {
    const pid_t decoder = DecoderOf(server.process().pid());
    if (decoder > 0 && kill(decoder, SIGKILL) == 0) ++kills;
    std::this_thread::sleep_for(milliseconds(350));
    if (watch.out().find("end_of_source") != std::string::npos) break;
  }
  server.process().Signal(SIGTERM);
  EXPECT_EQ(server.process().Wait(seconds(5)), 0) << server.process().err();
  watch.WaitForEnd(seconds(5));
  std::vector<double> fps;  // of the source, over the last two seconds, once a second
  std::istringstream lines(watch.out());
  for (std::string line; std::getline(lines, line);) {
    const auto event = nlohmann::json::parse(line, nullptr, /*allow_exceptions=*/false);
    if (!event.is_object() || event.contains("end_of_source")) break;
    if (event.contains("statistics")) {
      fps.push_back(event["statistics"]["captured_fps_hz"].get<double>());
    }
  }
  ASSERT_GE(fps.size(), 5u) << watch.out().substr(0, 500);
  // The first window is not full yet. A second without a frame would leave 15 of 30 in one.
  const double least = *std::min_element(fps.begin() + 2, fps.end());
  std::printf("%d kills in %zu s; least rate of frames over two seconds %.1f of 30\n", kills,
              fps.size(), least);
  EXPECT_GT(least, 16);
  EXPECT_GE(kills, kKills - 2);  // near its end the video is decoded already
}

}  // namespace
}  // namespace saccade::testing::decoder_killed_test
