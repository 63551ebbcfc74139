// Pictures that are broken, too large or out of reach while the server runs.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "tests/integration/bad_inputs/bad_data_set.hpp"
#include "tests/integration/bad_inputs/table.hpp"

namespace saccade::testing::picture_test {
namespace {

namespace fs = std::filesystem;

TEST_F(BadDataSet, BrokenPicturesAreSkippedCountedAndNamed) {
  const std::vector<std::string> arguments = Spoiled([](const fs::path& p) {
    fs::remove(p / "rgb" / "0.000000.png");
    WriteText(p / "rgb" / "0.033333.png", "");
    const auto third = p / "rgb" / "0.066667.png";
    fs::resize_file(third, fs::file_size(third) / 2);
    WriteText(p / "rgb" / "0.100000.png", std::string(5000, 'x'));
  });
  Server server(arguments);
  std::string err;
  for (int i = 0; i < 100 && err.find("0.100000") == std::string::npos; ++i) {
    server.process().Wait(std::chrono::milliseconds(50));
    err = server.process().err();
  }
  const RunResult status =
      RunProgram({SACCADE_PROGRAM, "--server", server.grpc(), "status", "--json"});
  const auto json = nlohmann::json::parse(status.out, nullptr, false);
  const bool named = err.find("0.000000.png") != std::string::npos &&
                     err.find("0.033333.png") != std::string::npos &&
                     err.find("0.100000.png") != std::string::npos;
  Row("start", "pictures: one missing, one of 0 bytes, one cut in half, one of rubbish",
      "skipped and named on stderr; serves: " + std::string(IsWell(server) ? "yes" : "no"),
      named && IsWell(server) && !json.is_discarded());
}

// Before, under this limit: terminate called after throwing an instance of 'cv::Exception'.
TEST_F(BadDataSet, APictureBombUnderAMemoryLimitIsSkipped) {
  std::vector<std::string> arguments = Spoiled([](const fs::path& p) {
    std::ifstream whole(p / "rgb" / "0.033333.png", std::ios::binary);
    std::string png(std::istreambuf_iterator<char>(whole), {});
    for (const std::size_t at : {16, 20}) png.replace(at, 4, std::string("\x00\x00\x75\x30", 4));
    WriteText(p / "rgb" / "0.033333.png", png);
    const cv::Mat large(6000, 6000, CV_8UC3, cv::Scalar(1, 2, 3));  // honest: 108 MB, and 36 grey
    cv::imwrite((p / "rgb" / "0.066667.png").string(), large);
  });
  Server server(arguments);
  rlimit limit{};  // little more than it has
  std::ifstream statm("/proc/" + std::to_string(server.process().pid()) + "/statm");
  std::size_t pages = 0;
  statm >> pages;
  limit.rlim_cur = limit.rlim_max = (pages * 4096) + (std::size_t{64} << 20);
  prlimit(server.process().pid(), RLIMIT_AS, &limit, nullptr);
  std::string err;
  for (int i = 0; i < 100 && err.find("0.066667") == std::string::npos; ++i) {
    server.process().Wait(std::chrono::milliseconds(50));
    err = server.process().err();
  }
  Row("start", "pictures: one claims 30000 x 30000, one is 6000 x 6000, memory is limited",
      "skipped and named: " + std::string(err.find("0.033333") != std::string::npos ? "yes" : "no"),
      err.find("0.033333") != std::string::npos && err.find("0.066667") != std::string::npos &&
          IsWell(server));
}

// Before: all of it was skipped in a moment, each frame as "cannot be read".
TEST_F(BadDataSet, WithoutAFreeDescriptorTheRecordingStandsStill) {
  const fs::path set = folder_.path() + "/long";
  WriteSmallDataset(set, {.frames = 90});
  Server server({"--source", "dataset:" + set.string(), "--data-dir", folder_ / "data"});
  const pid_t pid = server.process().pid();
  rlimit before{};
  ASSERT_EQ(prlimit(pid, RLIMIT_NOFILE, nullptr, &before), 0);
  rlimit none = before;
  none.rlim_cur = 0;
  ASSERT_EQ(prlimit(pid, RLIMIT_NOFILE, &none, nullptr), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(3500));  // the recording has 3 s
  ASSERT_EQ(prlimit(pid, RLIMIT_NOFILE, &before, nullptr), 0);
  // Goes on where it was, to the last frame.
  std::int64_t frame = -1, first = -1;
  for (int i = 0; i < 100 && frame < 89; ++i) {
    const RunResult status =
        RunProgram({SACCADE_PROGRAM, "--server", server.grpc(), "status", "--json"});
    const auto json = nlohmann::json::parse(status.out, nullptr, false);
    ASSERT_FALSE(json.is_discarded()) << status.err;
    frame = json["pose"]["frame_id"];
    if (first < 0) first = frame;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const std::string err = server.process().err();
  Row("start", "no file descriptor free for 3.5 s of a recording of 3 s",
      "waits and says so; afterwards at frame " + std::to_string(first) + ", then to the last",
      err.find("waits: ") != std::string::npos && err.find("skipped") == std::string::npos &&
          first < 89 && frame == 89);
}

TEST_F(BadDataSet, PicturesThatCannotBeVideoAreRefused) {
  fs::create_directories(folder_ / "wide/rgb");
  cv::imwrite(folder_ / "wide/rgb/0.png", cv::Mat(640, 4400, CV_8UC1, cv::Scalar(9)));
  WriteText(folder_ / "wide/rgb.txt", "0 rgb/0.png\n");
  WriteText(folder_ / "wide/camera.yaml",
            "model: pinhole\nwidth: 4400\nheight: 640\nfx: 3000\nfy: 3000\ncx: 2200\ncy: 320\n");
  ExpectRefusedStart("pictures wider than the video coder takes",
                     {"--source", "dataset:" + (folder_ / "wide"), "--data-dir", folder_ / "data"},
                     1, "no video");
}

TEST_F(BadDataSet, PictureOfAnotherSizeIsSkipped) {
  const std::vector<std::string> arguments = Spoiled([](const fs::path& p) {
    const TemporaryFolder other;
    WriteSmallDataset(other / "set", {.frames = 2, .width = 160, .height = 120});
    fs::copy_file(other / "set/rgb/0.033333.png", p / "rgb" / "0.033333.png",
                  fs::copy_options::overwrite_existing);
  });
  Server server(arguments);
  std::string err;
  for (int i = 0; i < 60 && err.find("0.033333") == std::string::npos; ++i) {
    server.process().Wait(std::chrono::milliseconds(50));
    err = server.process().err();
  }
  const auto at = err.find("0.033333");
  const auto begin = at == std::string::npos ? 0 : err.rfind('\n', at) + 1;
  Row("start", "picture of 160 x 120 in a data set of 320 x 240",
      err.substr(begin, err.find('\n', at) - begin), at != std::string::npos && IsWell(server));
}

}  // namespace
}  // namespace saccade::testing::picture_test
