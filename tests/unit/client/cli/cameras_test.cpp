#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "client/cli/cameras_command.hpp"

namespace saccade::cli::cameras_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::vector<ListedVideoDevice> TwoDevices() {
  VideoDeviceFacts facts{"/dev/video0", "HD Webcam", "uvcvideo", "usb-1", {}};
  facts.modes = {{V4L2_PIX_FMT_MJPEG, 1280, 720, 1280, 720, 1, 1, {30, 15}},
                 {V4L2_PIX_FMT_H264, 640, 480, 640, 480, 1, 1, {30}}};
  return {{facts, ""}, {{"/dev/video1", "", "", "", {}}, "/dev/video1: gives no pictures"}};
}

TEST(Cameras, AreToldWithModesAndHowToUseThem) {
  EXPECT_EQ(CamerasText(TwoDevices()),
            "/dev/video0  HD Webcam (uvcvideo, usb-1)\n"
            "  mjpeg 1280x720 30/15 fps\n"
            "  H264 640x480 30 fps  (not read)\n"
            "  use it: saccade-server --source v4l2:/dev/video0\n"
            "/dev/video1: gives no pictures\n");
}

TEST(Cameras, NoneIsSaidClearly) {
  EXPECT_THAT(CamerasText({}), AllOf(HasSubstr("no camera is there"), HasSubstr("plug one in")));
  EXPECT_EQ(CamerasJson({}).dump(), "{\"cameras\":[]}");
}

TEST(Cameras, JsonHasEveryMode) {
  const nlohmann::json json = CamerasJson(TwoDevices());
  EXPECT_EQ(json["cameras"][0]["modes"][0]["fps"][1], 15);
  EXPECT_EQ(json["cameras"][0]["modes"][1]["readable"], false);
  EXPECT_EQ(json["cameras"][1]["problem"], "/dev/video1: gives no pictures");
}

}  // namespace
}  // namespace saccade::cli::cameras_test
