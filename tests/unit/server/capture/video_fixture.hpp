#pragma once

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "server/capture/video/video_source.hpp"

namespace saccade {

/// Real videos, made by Debian's ffmpeg: each frame shows its number, in blocks that survive any
/// coding, before a coloured ramp.
class VideoFixture : public ::testing::Test {
 protected:
  static constexpr int kWidth = 320, kHeight = 240, kFrames = 240, kBits = 10;

  static void SetUpTestSuite() {
    std::string pattern = (std::filesystem::temp_directory_path() / "saccade-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder() = pattern;
    Make("walk.mp4", "-c:v libx264 -preset ultrafast -g 30 -pix_fmt yuv420p");
    Make("walk.mkv", "-c:v ffv1 -pix_fmt bgr0", 40);
    Make("walk.avi", "-c:v mjpeg -q:v 2 -pix_fmt yuvj420p", 40);
    Make("lying.mp4", "-c:v libx264 -preset ultrafast -pix_fmt yuv420p", 5);
    // What telephones write; ffmpeg itself shows this one turned to the left.
    const std::string held = "ffmpeg -v error -y -i " + File("lying.mp4") + " -c copy " +
                             "-metadata:s:v rotate=90 " + File("held.mp4");
    ASSERT_EQ(std::system(held.c_str()), 0);
    Make("grey.mkv", "-c:v ffv1 -pix_fmt gray", 10);
    // The time between frames grows: 10, 20, 30 ... ms.
    Make("uneven.mp4",
         "-vf 'settb=1/1000,setpts=5*N*(N+1)' -vsync vfr -enc_time_base 1/1000 -c:v libx264 "
         "-preset ultrafast -bf 0 -pix_fmt yuv420p -video_track_timescale 1000",
         20);
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder()); }

  static std::filesystem::path& folder() {
    static std::filesystem::path path;
    return path;
  }
  static std::string File(const std::string& name) { return (folder() / name).string(); }

  static cv::Mat PictureOf(int number) {
    cv::Mat picture(kHeight, kWidth, CV_8UC3);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        picture.at<cv::Vec3b>(v, u) =
            cv::Vec3b(static_cast<uchar>(u / 2 + 40), static_cast<uchar>(v / 2 + 60),
                      static_cast<uchar>(200 - u / 4));
      }
    }
    for (int bit = 0; bit < kBits; ++bit) {
      const uchar shade = (number >> bit & 1) != 0 ? 235 : 20;
      cv::rectangle(picture, cv::Rect(bit * 32, 0, 32, 64), cv::Scalar::all(shade), cv::FILLED);
    }
    return picture;
  }
  /// The number that a frame shows.
  static int NumberIn(const Frame& frame) {
    int number = 0;
    for (int bit = 0; bit < kBits; ++bit) {
      const double mean = cv::mean(frame.grey(cv::Rect(bit * 32 + 8, 16, 16, 32)))[0];
      if (mean > 128) number |= 1 << bit;
    }
    return number;
  }

  static void Make(const std::string& name, const std::string& coding, int frames = kFrames) {
    const std::string command =
        "ffmpeg -v error -y -f rawvideo -pix_fmt bgr24 -s 320x240 -r 30 "
        "-i - " +
        coding + " " + File(name);
    signal(SIGPIPE, SIG_IGN);  // said below
    FILE* ffmpeg = popen(command.c_str(), "w");
    ASSERT_NE(ffmpeg, nullptr);
    for (int i = 0; i < frames; ++i) {
      const cv::Mat picture = PictureOf(i);
      fwrite(picture.data, 1, picture.total() * picture.elemSize(), ffmpeg);
    }
    ASSERT_EQ(pclose(ffmpeg), 0) << "ffmpeg (deploy/install test) could not make " << name;
  }

  static absl::StatusOr<std::unique_ptr<VideoSource>> Open(const std::string& rest,
                                                           bool realtime = false,
                                                           const std::string& camera = "") {
    SourceOptions options;
    options.realtime = realtime;
    options.camera_file = camera;
    return OpenVideoFile(rest, options);
  }
  static std::string Refusal(const std::string& rest) {
    return std::string(Open(rest).status().message());
  }
};

}  // namespace saccade
