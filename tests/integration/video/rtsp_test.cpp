// rtsp: against a real server of Debian's: frames, their times, a decoder and a server that die.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

#include "server/capture/video/video_source.hpp"
#include "tests/integration/support/process.hpp"

namespace saccade::testing::rtsp_test {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;

class Rtsp : public ::testing::Test {
 protected:
  void SetUp() override { StartServer(""); }

  void StartServer(const std::string& port) {
    std::vector<std::string> words = {std::string(SACCADE_SOURCE_DIR) +
                                      "/tests/integration/video/rtsp_server"};
    if (!port.empty()) words.push_back(port);
    server_ = std::make_unique<Process>(words);
    const auto line = server_->WaitForLine("port ", seconds(40));
    ASSERT_TRUE(line) << "is GStreamer's RTSP server there (deploy/install test)? "
                      << server_->err();
    port_ = line->substr(line->find("port ") + 5);
  }
  absl::StatusOr<std::unique_ptr<VideoSource>> Open() {
    SourceOptions options;
    options.realtime = true;
    return OpenRtsp("//ada:secret@localhost:" + port_ + "/cam", options);
  }

  std::unique_ptr<Process> server_;
  std::string port_;
};

TEST_F(Rtsp, LiveFramesComeOnTheMonotonicClockAndOutliveTheirDecoder) {
  const auto source = Open();
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_EQ((*source)->info().camera->width(), 320);
  EXPECT_EQ((*source)->info().uri, "rtsp://localhost:" + port_ + "/cam") << "everybody reads it";
  // Nor in what every account of the machine, or this one, sees of the decoder.
  for (const char* words : {"cmdline", "environ"}) {
    std::ifstream in("/proc/" + std::to_string((*source)->decoder_pid()) + "/" + words);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    EXPECT_EQ(text.find("secret"), std::string::npos) << words << ": " << text;
  }
  std::vector<Timestamp> times;
  for (int i = 0; i < 90; ++i) {
    const auto frame = (*source)->Next();
    ASSERT_TRUE(frame.ok() && *frame) << frame.status();
    EXPECT_EQ((*frame)->color.size(), cv::Size(320, 240));
    if (!times.empty()) {
      EXPECT_GT((*frame)->capture_time_ns, times.back());
    }
    times.push_back((*frame)->capture_time_ns);
    EXPECT_LE((*frame)->capture_time_ns, (*frame)->received_time_ns);
    EXPECT_LT((*frame)->received_time_ns - (*frame)->capture_time_ns, 1'000'000'000);
  }
  // Of the stream's own clock, not of when frames happened to come.
  const double mean_s = Seconds(times[89] - times[30]) / 59;
  EXPECT_GT(mean_s, 0.9 / 30);
  kill((*source)->decoder_pid(), SIGKILL);
  for (int i = 0; i < 30; ++i) {
    const auto frame = (*source)->Next();
    ASSERT_TRUE(frame.ok() && *frame);
    EXPECT_GT((*frame)->capture_time_ns, times.back());
    times.push_back((*frame)->capture_time_ns);
  }
  EXPECT_GE((*source)->decoder_restarts(), 1u);
}

TEST_F(Rtsp, ServerThatGoesIsAskedAgainAndStopEndsTheWait) {
  const auto source = Open();
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_TRUE((*source)->Next()->has_value());
  server_->Signal(SIGKILL);
  server_->Wait(seconds(5));
  std::promise<bool> stop_now;
  auto next = std::async(std::launch::async, [&] {
    for (int i = 0; i < 1000; ++i) {
      const auto frame = (*source)->Next();
      if (!frame.ok()) return false;
      if (!*frame) return true;  // stopped
      if ((*source)->decoder_restarts() > 0) stop_now.set_value(true);
      if ((*source)->decoder_restarts() > 0) break;
    }
    while ((*source)->Next()->has_value()) {
    }
    return true;
  });
  StartServer(port_);
  ASSERT_EQ(stop_now.get_future().wait_for(seconds(60)), std::future_status::ready);
  server_->Signal(SIGKILL);
  (*source)->Stop();
  ASSERT_EQ(next.wait_for(seconds(3)), std::future_status::ready);
  EXPECT_TRUE(next.get());
}

TEST_F(Rtsp, IsRecordedUntilCtrlCAndOpensAsADataSet) {
  TemporaryFolder folder;
  const std::string out = folder / "set";
  Process record(
      {SACCADE_PROGRAM, "record", "--source", "rtsp://localhost:" + port_ + "/cam", "--out", out});
  // The list grows behind the pictures.
  for (int i = 0;
       i < 300 && (!fs::exists(out + "/rgb.txt") || fs::file_size(out + "/rgb.txt") < 500); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  record.Signal(SIGINT);
  EXPECT_EQ(record.Wait(seconds(5)), 0) << record.err();
  record.WaitForEnd(seconds(2));
  EXPECT_THAT(record.out(), HasSubstr("open it with --source dataset:"));
  const auto source = OpenSource("dataset:" + out, {});
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_GT((*source)->info().frame_count, 5u);
  EXPECT_TRUE((*source)->Next()->has_value());
}

TEST(Record, APhoneIsRefusedWithWhatToDoInstead) {
  const TemporaryFolder folder;
  for (const char* command : {"record", "calibrate-camera"}) {
    std::vector<std::string> words = {SACCADE_PROGRAM, command, "--source",
                                      "phone:",        "--out", folder / command};
    if (std::string(command) == "calibrate-camera") {
      words.insert(words.end(), {"--board", "9x6", "--square", "0.025"});
    }
    const RunResult result = RunProgram(words);
    EXPECT_NE(result.exit_code, 0);
    EXPECT_THAT(result.err, HasSubstr("film with the phone's own camera")) << command;
    EXPECT_THAT(result.err, HasSubstr("--source file:VIDEO")) << command;
  }
}

}  // namespace
}  // namespace saccade::testing::rtsp_test
