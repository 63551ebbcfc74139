#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "server/capture/v4l2/v4l2_camera.hpp"
#include "shared/io/video_modes.hpp"
#include "tests/unit/server/capture/v4l2_fixture.hpp"

namespace saccade::v4l2_options_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST_F(V4l2, RefusesWhatItDoesNotHaveAndSaysWhatItHas) {
  camera_->modes = {{V4L2_PIX_FMT_YUYV, 64, 48, {30}},
                    {V4L2_PIX_FMT_MJPEG, 128, 96, {60, 30}},
                    {V4L2_PIX_FMT_H264, 640, 480, {30}}};
  camera_->controls[V4L2_CID_GAIN] = {0, 100, 20};
  const char kModes[] = "it has yuyv 64x48 30 fps, mjpeg 128x96 60/30 fps";
  EXPECT_THAT(
      Refusal("?size=320x240"),
      AllOf(HasSubstr("/dev/video7 (Fake Camera) does not have 320x240"), HasSubstr(kModes)));
  EXPECT_THAT(Refusal("?format=nv12"), AllOf(HasSubstr("does not have nv12"), HasSubstr(kModes)));
  EXPECT_THAT(Refusal("?fps=60&size=64x48"), HasSubstr("does not have 64x48 at 60 fps"));
  EXPECT_THAT(Refusal("?exposure=5"),
              HasSubstr("this camera has no exposure; it has gain 0 to 100"));
  EXPECT_THAT(Refusal("?focus=auto"), HasSubstr("this camera has no focus=auto"));
  EXPECT_THAT(Refusal("?gain=101"), HasSubstr("gain 101: beyond its range; it has gain 0 to 100"));
  EXPECT_THAT(Refusal("?zoom=2"), HasSubstr("zoom is not known; there are size, fps, format"));
  EXPECT_THAT(Refusal("?rotate=45"), HasSubstr("give 0, 90, 180 or 270"));
  EXPECT_THAT(Refusal("?format=h264"), HasSubstr("give mjpeg, yuyv, nv12 or grey"));
  EXPECT_THAT(Refusal("?size=big"), HasSubstr("not a size such as 640x480"));
  EXPECT_THAT(Refusal("?size=64x48&size=64x48"), HasSubstr("size is there twice"));
  camera_->start_refused = EBUSY;
  EXPECT_THAT(Refusal(""), HasSubstr("another program uses it"));
  camera_->start_refused = ENOSPC;
  EXPECT_THAT(Refusal(""), HasSubstr("no USB bandwidth"));
  camera_->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_THAT(Refusal(""), AllOf(HasSubstr("gives no pictures"), HasSubstr("saccade cameras")));
  const auto every = Open("", SourceOptions());
  EXPECT_THAT(std::string(every.status().message()), HasSubstr("leave --speed max out"));
  EXPECT_TRUE(absl::IsNotFound(OpenSource("v4l2:/dev/no-such", Live()).status()));
  EXPECT_THAT(std::string(OpenSource("v4l2:/dev/null", Live()).status().message()),
              HasSubstr("is no V4L2 device"));
}

TEST_F(V4l2, ChoosesWhatSuitsTheTrackerAndWhatIsAskedFor) {
  camera_->modes = {{V4L2_PIX_FMT_MJPEG, 1920, 1080, {30}},
                    {V4L2_PIX_FMT_MJPEG, 640, 480, {60, 30}},
                    {V4L2_PIX_FMT_YUYV, 1280, 720, {10}},
                    {V4L2_PIX_FMT_YUYV, 640, 480, {30}},
                    {V4L2_PIX_FMT_GREY, 640, 480, {30}}};
  const auto facts = ReadVideoDevice("/dev/video7", **FakeCamera::Opener(camera_)("/dev/video7"));
  ASSERT_TRUE(facts.ok());
  const auto chosen = [&](const std::string& query) {
    const auto request = V4l2Request::Parse("/dev/video7" + query);
    const auto mode = ChooseMode(*facts, *request);
    return mode.ok() ? ModeWords(*mode) : std::string(mode.status().message());
  };
  EXPECT_EQ(chosen(""), "yuyv 640x480 30 fps");
  EXPECT_EQ(chosen("?format=mjpeg"), "mjpeg 640x480 60/30 fps");
  EXPECT_EQ(chosen("?fps=60"), "mjpeg 640x480 60/30 fps");
  EXPECT_EQ(chosen("?size=1280x720"), "yuyv 1280x720 10 fps");
  EXPECT_EQ(chosen("?size=1920x1080&fps=29.97"), "mjpeg 1920x1080 30 fps");
  Start("?size=640x480&fps=60&format=mjpeg");
  EXPECT_EQ(camera_->fps_set(), 60);
  EXPECT_EQ(source_->info().camera->intrinsics().fps, 60);
}

TEST_F(V4l2, FocusIsFixedUnlessAskedForAndControlsAreSet) {
  camera_->controls = {{V4L2_CID_FOCUS_AUTO, {0, 1, 1}},
                       {V4L2_CID_FOCUS_ABSOLUTE, {0, 250, 30}},
                       {V4L2_CID_EXPOSURE_AUTO, {0, 3, V4L2_EXPOSURE_APERTURE_PRIORITY}},
                       {V4L2_CID_EXPOSURE_AUTO_PRIORITY, {0, 1, 1}},
                       {V4L2_CID_EXPOSURE_ABSOLUTE, {1, 5000, 157}},
                       {V4L2_CID_AUTOGAIN, {0, 1, 1}},
                       {V4L2_CID_GAIN, {0, 255, 0}}};
  Start();
  EXPECT_EQ(camera_->Value(V4L2_CID_FOCUS_AUTO), 0);
  EXPECT_EQ(camera_->Value(V4L2_CID_FOCUS_ABSOLUTE), 30);
  EXPECT_EQ(camera_->Value(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_APERTURE_PRIORITY);
  EXPECT_EQ(camera_->Value(V4L2_CID_EXPOSURE_AUTO_PRIORITY), 0);
  Start("?exposure=12.5&gain=40&focus=90");
  EXPECT_EQ(camera_->Value(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera_->Value(V4L2_CID_EXPOSURE_ABSOLUTE), 125);
  EXPECT_EQ(camera_->Value(V4L2_CID_AUTOGAIN), 0);
  EXPECT_EQ(camera_->Value(V4L2_CID_GAIN), 40);
  EXPECT_EQ(camera_->Value(V4L2_CID_FOCUS_ABSOLUTE), 90);
  Start("?focus=auto");
  EXPECT_EQ(camera_->Value(V4L2_CID_FOCUS_AUTO), 1);
}

TEST_F(V4l2, WithoutAFileTheLensIsAssumedAndSaidSo) {
  Start();
  const CameraIntrinsics& lens = source_->info().camera->intrinsics();
  const double view = 2 * std::atan(0.5 * kWidth / lens.fx) * 180 / std::numbers::pi;
  EXPECT_NEAR(view, 60.0, 1e-9);
  EXPECT_EQ(lens.fx, lens.fy);
  EXPECT_THAT(source_->info().remark,
              AllOf(HasSubstr("60 deg"), HasSubstr("not metric"), HasSubstr("--camera")));
  EXPECT_FALSE(source_->info().target.has_value());
}

TEST_F(V4l2, TurnsAndMirrorsPicturesAndLens) {
  const cv::Mat scene = Scene();
  struct Case {
    const char* query;
    int rotate;  // cv::RotateFlags, -1: none
    bool mirror;
  };
  for (const Case& each :
       {Case{"?rotate=90", cv::ROTATE_90_CLOCKWISE, false},
        Case{"?rotate=180", cv::ROTATE_180, false},
        Case{"?rotate=270", cv::ROTATE_90_COUNTERCLOCKWISE, false}, Case{"?mirror=1", -1, true},
        Case{"?rotate=90&mirror=1", cv::ROTATE_90_CLOCKWISE, true}}) {
    SCOPED_TRACE(each.query);
    Start(each.query);
    cv::Mat upright = scene.clone();
    if (each.rotate >= 0) cv::rotate(scene, upright, each.rotate);
    if (each.mirror) cv::flip(upright.clone(), upright, 1);
    const std::optional<Frame> frame = Take(Shot());
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->color.size(), upright.size());
    EXPECT_LT(MeanDifference(frame->color, upright), 4.0);
    EXPECT_EQ(frame->grey.size(), upright.size());
    const CameraIntrinsics& lens = source_->info().camera->intrinsics();
    EXPECT_EQ(lens.width, upright.cols);
    // The sensor's own width is 60 degrees wide, whichever way it lies.
    EXPECT_NEAR(lens.fx, 0.5 * kWidth / std::tan(std::numbers::pi / 6), 1e-9);
  }
}

TEST_F(V4l2, CameraFileDecidesTheModeOrIsRefused) {
  const std::string file = ::testing::TempDir() + "v4l2-camera.yaml";
  std::ofstream(file) << "model: pinhole\nwidth: 96\nheight: 128\nfx: 110\nfy: 110\n"
                         "cx: 47\ncy: 63\nfps: 30\n";
  camera_->modes = {{V4L2_PIX_FMT_YUYV, 64, 48, {30}}, {V4L2_PIX_FMT_YUYV, 128, 96, {30}}};
  const SourceOptions options = Live(file);
  const auto opened = Open("?rotate=270", options);
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_EQ((*opened)->info().camera->width(), 96);
  EXPECT_EQ((*opened)->info().camera->intrinsics().fx, 110);
  EXPECT_EQ((*opened)->info().remark, "");
  EXPECT_THAT(std::string(Open("?size=64x48", options).status().message()),
              AllOf(HasSubstr("pictures of 96x128"), HasSubstr("leave size out")));
}

TEST(VideoDevices, AreListedInOrderWithWhatIsWrongWithThem) {
  const std::filesystem::path folder = ::testing::TempDir() + "devices";
  std::filesystem::create_directories(folder);
  for (const char* name : {"video10", "video2", "video0", "videogame", "null"}) {
    std::ofstream(folder / name) << "";
  }
  const auto camera = std::make_shared<FakeCamera>();
  const auto open = [&](const std::string& path) -> absl::StatusOr<std::unique_ptr<VideoDevice>> {
    if (path.ends_with("video2")) return absl::PermissionDeniedError(path + ": may not be opened");
    return FakeCamera::Opener(camera)(path);
  };
  const std::vector<ListedVideoDevice> found = ListVideoDevices(folder, open);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].facts.name, "Fake Camera");
  EXPECT_EQ(ModeWords(found[0].facts.modes), "yuyv 64x48 30/15 fps");
  EXPECT_THAT(found[1].problem, HasSubstr("may not be opened"));
  EXPECT_TRUE(found[2].facts.path.ends_with("video10"));
  EXPECT_TRUE(ListVideoDevices(folder / "nothing").empty());
}

}  // namespace
}  // namespace saccade::v4l2_options_test
