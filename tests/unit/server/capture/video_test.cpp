#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <chrono>
#include <fstream>
#include <future>
#include <thread>

#include "tests/unit/server/capture/video_fixture.hpp"

namespace saccade::video_test {
namespace {

using std::chrono::milliseconds;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Video : public VideoFixture {
 protected:
  static std::vector<Frame> All(FrameSource& source) {
    std::vector<Frame> frames;
    while (true) {
      auto frame = source.Next();
      EXPECT_TRUE(frame.ok()) << frame.status();
      if (!frame.ok() || !*frame) return frames;
      frames.push_back(**std::move(frame));
    }
  }
};

TEST_F(Video, Mp4MkvAndAviGiveEveryFrameWithItsTime) {
  for (const auto& [name, count] :
       {std::pair("walk.mp4", kFrames), std::pair("walk.mkv", 40), std::pair("walk.avi", 40)}) {
    SCOPED_TRACE(name);
    const auto source = Open(File(name));
    ASSERT_TRUE(source.ok()) << source.status();
    EXPECT_NEAR((*source)->info().camera->intrinsics().fps, 30, 1e-6);
    EXPECT_THAT((*source)->info().remark, HasSubstr("60 deg"));
    const std::vector<Frame> frames = All(**source);
    ASSERT_EQ(frames.size(), static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      EXPECT_EQ(frames[i].id, static_cast<FrameId>(i));
      EXPECT_EQ(NumberIn(frames[i]), i);
      EXPECT_NEAR(Seconds(frames[i].capture_time_ns), i / 30.0, 0.0006);  // MKV has milliseconds
      EXPECT_EQ(frames[i].color.size(), cv::Size(kWidth, kHeight));
    }
    EXPECT_EQ((*source)->bad_frames(), 0u);
    EXPECT_EQ((*source)->decoder_restarts(), 0u);
  }
}

TEST_F(Video, LosslessVideoIsTheSamePictureToTheByte) {
  const auto source = Open(File("walk.mkv"));
  ASSERT_TRUE(source.ok());
  const std::vector<Frame> frames = All(**source);
  ASSERT_EQ(frames.size(), 40u);
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(cv::norm(frames[i].color, PictureOf(i), cv::NORM_INF), 0) << i;
    cv::Mat grey;
    cv::cvtColor(PictureOf(i), grey, cv::COLOR_BGR2GRAY);
    EXPECT_EQ(cv::norm(frames[i].grey, grey, cv::NORM_INF), 0) << i;
  }
}

TEST_F(Video, ColoursOfCodedVideosAreThoseOfTheScene) {
  for (const char* name : {"walk.mp4", "walk.avi"}) {
    const auto source = Open(File(name));
    ASSERT_TRUE(source.ok());
    const auto frame = (*source)->Next();
    cv::Mat difference;
    cv::absdiff((*frame)->color, PictureOf(0), difference);
    const cv::Scalar mean = cv::mean(difference);
    EXPECT_LT(std::max({mean[0], mean[1], mean[2]}), 4.0) << name << " " << mean;
  }
}

TEST_F(Video, GreyVideoHasNoColour) {
  const auto source = Open(File("grey.mkv"));
  ASSERT_TRUE(source.ok());
  const auto frame = (*source)->Next();
  EXPECT_TRUE((*frame)->color.empty());
  EXPECT_EQ((*frame)->grey.size(), cv::Size(kWidth, kHeight));
}

TEST_F(Video, UnevenTimesAndTheirBeginningAreKept) {
  const auto source = Open(File("uneven.mp4") + "?start=1305031102.175304");
  ASSERT_TRUE(source.ok()) << source.status();
  const std::vector<Frame> frames = All(**source);
  ASSERT_EQ(frames.size(), 20u);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(frames[i].capture_time_ns,
              1'305'031'102'175'304'000 + std::int64_t{5'000'000} * i * (i + 1));
  }
  EXPECT_EQ(frames[1].source_timestamp, "1305031102.185304000");
}

TEST_F(Video, RangeTurnAndCameraFileAreObeyed) {
  SourceOptions options;
  options.first_frame = 30;
  options.end_frame = 35;
  const auto part = OpenVideoFile(File("walk.mp4"), options);
  ASSERT_TRUE(part.ok());
  const std::vector<Frame> frames = All(**part);
  ASSERT_EQ(frames.size(), 5u);
  EXPECT_EQ(NumberIn(frames[0]), 30);
  EXPECT_EQ(frames[0].id, 30u);

  const auto turned = Open(File("walk.mkv") + "?rotate=90&mirror=1");
  ASSERT_TRUE(turned.ok());
  cv::Mat upright;
  cv::rotate(PictureOf(0), upright, cv::ROTATE_90_CLOCKWISE);
  cv::flip(upright.clone(), upright, 1);
  EXPECT_EQ(cv::norm((*(*turned)->Next())->color, upright, cv::NORM_INF), 0);
  EXPECT_EQ((*turned)->info().camera->width(), kHeight);

  std::ofstream(File("camera.yaml")) << "model: pinhole\nwidth: 320\nheight: 240\nfx: 200\n"
                                        "fy: 200\ncx: 160\ncy: 120\nfps: 30\n";
  const auto measured = Open(File("walk.mp4"), false, File("camera.yaml"));
  ASSERT_TRUE(measured.ok());
  EXPECT_EQ((*measured)->info().camera->intrinsics().fx, 200);
  EXPECT_EQ((*measured)->info().remark, "");
  EXPECT_THAT(
      std::string(
          Open(File("walk.mp4") + "?rotate=90", false, File("camera.yaml")).status().message()),
      AllOf(HasSubstr("is of pictures of 320x240"), HasSubstr("are 240x320")));
}

TEST_F(Video, TelephonesFileSaysHowItWasHeld) {
  cv::Mat upright, difference;
  cv::rotate(PictureOf(0), upright, cv::ROTATE_90_COUNTERCLOCKWISE);
  const auto source = Open(File("held.mp4"));
  ASSERT_TRUE(source.ok());
  const auto frame = (*source)->Next();
  ASSERT_EQ((*frame)->color.size(), upright.size());
  cv::absdiff((*frame)->color, upright, difference);
  EXPECT_LT(cv::mean(difference)[0], 4.0);
  EXPECT_EQ((*source)->info().camera->width(), kHeight);
  const auto as_coded = Open(File("held.mp4") + "?rotate=0");
  EXPECT_EQ((*(*as_coded)->Next())->color.size(), cv::Size(kWidth, kHeight));
}

TEST_F(Video, DecoderKilledTwentyTimesLosesNoFrame) {
  const auto source = Open(File("walk.mp4"));
  ASSERT_TRUE(source.ok());
  int kills = 0;
  for (int i = 0; i < kFrames; ++i) {
    const auto frame = (*source)->Next();
    ASSERT_TRUE(frame.ok() && *frame) << i;
    ASSERT_EQ(NumberIn(**frame), i);
    ASSERT_EQ((*frame)->id, static_cast<FrameId>(i));
    const pid_t decoder = (*source)->decoder_pid();
    if (i % 11 == 5 && kills < 20 && decoder > 0 && kill(decoder, SIGKILL) == 0) ++kills;
  }
  EXPECT_FALSE((*source)->Next()->has_value());
  EXPECT_EQ(kills, 20);
  EXPECT_GE((*source)->decoder_restarts(), 18u);  // a kill may meet one that is starting
  EXPECT_EQ((*source)->bad_frames(), 0u);
}

TEST_F(Video, KilledTwentyTimesNoFrameInRealTimeIsASecondLate) {
  const auto source = Open(File("walk.mp4"), /*realtime=*/true);
  ASSERT_TRUE(source.ok());
  std::atomic<bool> over = false;
  std::thread killer([&] {
    for (int i = 0; i < 20 && !over; ++i) {
      std::this_thread::sleep_for(milliseconds(280));
      if (const pid_t decoder = (*source)->decoder_pid(); decoder > 0) kill(decoder, SIGKILL);
    }
  });
  Timestamp last_ns = MonotonicNow(), longest_ns = 0;
  int frames = 0, last = -1;
  while (true) {
    const auto frame = (*source)->Next();
    ASSERT_TRUE(frame.ok());
    if (!*frame) break;
    const Timestamp now_ns = MonotonicNow();
    longest_ns = std::max(longest_ns, now_ns - std::exchange(last_ns, now_ns));
    EXPECT_GT(NumberIn(**frame), last);
    last = NumberIn(**frame);
    ++frames;
  }
  over = true;
  killer.join();
  std::printf("longest wait for a frame: %.0f ms; %d of %d frames, %d restarts\n",
              1e3 * Seconds(longest_ns), frames, kFrames,
              static_cast<int>((*source)->decoder_restarts()));
  EXPECT_LT(Seconds(longest_ns), 1.0);
  EXPECT_EQ(last, kFrames - 1);
  EXPECT_GE((*source)->decoder_restarts(), 12u);  // near the end all is decoded already
  EXPECT_GT(frames, kFrames / 2);
}

TEST_F(Video, DecoderThatHangsIsReplaced) {
  const auto source = Open(File("walk.mp4"));
  ASSERT_TRUE(source.ok());
  for (int i = 0; i < kFrames; ++i) {
    const auto frame = (*source)->Next();
    ASSERT_TRUE(frame.ok() && *frame);
    ASSERT_EQ(NumberIn(**frame), i);
    if (i == 50) kill((*source)->decoder_pid(), SIGSTOP);
  }
  EXPECT_EQ((*source)->decoder_restarts(), 1u);
}

TEST_F(Video, RealTimeKeepsTheVideosPaceAndStopEndsTheWait) {
  const auto source = Open(File("walk.avi"), /*realtime=*/true);
  ASSERT_TRUE(source.ok());
  const Timestamp begin_ns = MonotonicNow();
  const std::vector<Frame> frames = All(**source);
  EXPECT_GE(Seconds(MonotonicNow() - begin_ns), 39 / 30.0 - 0.01);
  EXPECT_EQ(NumberIn(frames.back()), 39);

  const auto stopped = Open(File("uneven.mp4"), /*realtime=*/true);
  ASSERT_TRUE(stopped.ok());
  auto read = std::async(std::launch::async, [&] { return All(**stopped).size(); });
  std::this_thread::sleep_for(milliseconds(200));
  (*stopped)->Stop();
  ASSERT_EQ(read.wait_for(std::chrono::seconds(1)), std::future_status::ready);
  EXPECT_LT(read.get(), 20u);
}

TEST_F(Video, DamagedFilesEndWithCauseAndRemedyOrLoseOnlyWhatIsDamaged) {
  std::filesystem::copy_file(File("walk.avi"), File("cut.avi"),
                             std::filesystem::copy_options::overwrite_existing);
  std::filesystem::resize_file(File("cut.avi"), std::filesystem::file_size(File("walk.avi")) / 2);
  const auto cut = Open(File("cut.avi"));
  ASSERT_TRUE(cut.ok());
  const std::vector<Frame> frames = All(**cut);
  EXPECT_GT(frames.size(), 10u);
  EXPECT_LT(frames.size(), 30u);
  for (std::size_t i = 0; i < frames.size(); ++i)
    EXPECT_EQ(NumberIn(frames[i]), static_cast<int>(i));

  std::ofstream(File("words.mp4")) << std::string(5000, 'x');
  EXPECT_THAT(
      Refusal(File("words.mp4")),
      AllOf(HasSubstr("words.mp4: it is no video that is read here"), HasSubstr("ffmpeg -i IN")));
  EXPECT_THAT(Refusal(File("none.mp4")), HasSubstr("none.mp4: No such file"));
  EXPECT_THAT(Refusal(folder().string()), HasSubstr("is no regular file"));
  ASSERT_EQ(mkfifo(File("pipe.mp4").c_str(), 0600), 0);
  EXPECT_THAT(Refusal(File("pipe.mp4")), HasSubstr("is no regular file"));
  EXPECT_THAT(Refusal(File("walk.mp4") + "?speed=2"),
              HasSubstr("speed is not known; there are start, rotate and mirror"));
  EXPECT_THAT(Refusal(""), HasSubstr("names no video"));
  // A playlist could name other files and hosts.
  std::ofstream(File("list.m3u8")) << "#EXTM3U\n#EXT-X-TARGETDURATION:5\n#EXTINF:5,\n"
                                   << File("walk.mp4") << "\n#EXT-X-ENDLIST\n";
  EXPECT_THAT(Refusal(File("list.m3u8")), HasSubstr("is no video that is read here"));
}

TEST_F(Video, StreamsThatAreNotThereAreRefusedWithARemedy) {
  SourceOptions live;
  live.realtime = true;
  EXPECT_THAT(std::string(OpenRtsp("//127.0.0.1:1/cam", live).status().message()),
              AllOf(HasSubstr("rtsp://127.0.0.1:1/cam: it cannot be opened"),
                    HasSubstr("is the address right?")));
  EXPECT_THAT(std::string(OpenRtsp("camera", live).status().message()),
              HasSubstr("write it as rtsp://HOST"));
  EXPECT_THAT(std::string(OpenRtsp("//camera/1", {}).status().message()),
              HasSubstr("leave --speed max"));
}

std::string Output(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  std::string text(4096, '\0');
  text.resize(fread(text.data(), 1, text.size(), pipe));
  pclose(pipe);
  return text;
}

TEST(DecoderSandbox, HoldsOffFilesNetworkAndPrograms) {
  const std::string program =
      (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "saccade-decode").string();
  const std::string file = Output(program + " --try-sandbox");
  for (const char* what :
       {"read /etc/passwd", "write /tmp", "make a folder", "open a socket", "start a process",
        "run a program", "signal the parent", "make memory executable"}) {
    EXPECT_THAT(file, HasSubstr(std::string(what) + ": refused")) << file;
  }
  EXPECT_THAT(file, ::testing::Not(HasSubstr("allowed")));
  const std::string stream = Output(program + " --try-sandbox --network");
  EXPECT_THAT(stream, HasSubstr("open a socket: allowed"));
  EXPECT_THAT(stream, HasSubstr("read /etc/passwd: refused"));
  EXPECT_THAT(stream, HasSubstr("run a program: refused"));
}

}  // namespace
}  // namespace saccade::video_test
