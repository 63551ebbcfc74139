#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "server/capture/v4l2/v4l2_camera.hpp"
#include "tests/unit/server/capture/v4l2_fixture.hpp"

namespace saccade::v4l2_test {
namespace {

TEST_F(V4l2, GivesGreyAndColourOfAllFourFormats) {
  const cv::Mat scene = Scene();
  cv::Mat grey;
  cv::cvtColor(scene, grey, cv::COLOR_BGR2GRAY);
  cv::Mat i420;
  cv::cvtColor(scene, i420, cv::COLOR_BGR2YUV_I420);
  const cv::Mat luminance = i420.rowRange(0, kHeight);
  struct Case {
    std::uint32_t fourcc;
    std::vector<std::uint8_t> bytes;
    cv::Mat grey;
    bool color;
  };
  const std::vector<std::uint8_t> plain(grey.data, grey.data + kWidth * kHeight);
  for (const Case& each : {Case{V4L2_PIX_FMT_MJPEG, Jpeg(scene), grey, true},
                           Case{V4L2_PIX_FMT_MJPEG, WithoutTables(Jpeg(scene)), grey, true},
                           Case{V4L2_PIX_FMT_YUYV, Yuv(scene, false), luminance, true},
                           Case{V4L2_PIX_FMT_NV12, Yuv(scene, true), luminance, true},
                           Case{V4L2_PIX_FMT_GREY, plain, grey, false}}) {
    SCOPED_TRACE(FormatName(each.fourcc));
    UseFormat(each.fourcc);
    Start();
    const std::optional<Frame> frame = Take({.bytes = each.bytes});
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->grey.size(), cv::Size(kWidth, kHeight));
    EXPECT_LT(MeanDifference(frame->grey, each.grey), 1.5);
    ASSERT_EQ(frame->color.empty(), !each.color);
    if (each.color) {
      EXPECT_LT(MeanDifference(frame->color, scene), 4.0);
    }
  }
}

TEST_F(V4l2, ReadsLinesWithPadding) {
  camera_->padding = 16;
  for (const bool nv12 : {false, true}) {
    UseFormat(nv12 ? V4L2_PIX_FMT_NV12 : V4L2_PIX_FMT_YUYV);
    Start();
    const std::optional<Frame> frame = Take({.bytes = Yuv(Scene(), nv12, 16)});
    ASSERT_TRUE(frame);
    EXPECT_LT(MeanDifference(frame->color, Scene()), 4.0);
  }
}

TEST_F(V4l2, StampsMidExposureFromEitherKindOfDriverStamp) {
  camera_->controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 500, 80};  // 8 ms
  Start();
  FakeCamera::Shot shot = Shot();
  shot.stamp_ns = (MonotonicNow() - 20 * kMs) / 1000 * 1000;
  EXPECT_EQ(Take(shot)->capture_time_ns, *shot.stamp_ns + 4 * kMs);
  camera_->stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  shot.stamp_ns = (MonotonicNow() - 1 * kMs) / 1000 * 1000;
  EXPECT_EQ(Take(shot)->capture_time_ns, *shot.stamp_ns - 4 * kMs);
  // The middle of a rolling shutter's middle line.
  EXPECT_EQ(MidExposure(100 * kMs, V4L2_BUF_FLAG_TSTAMP_SRC_SOE, 8 * kMs, 20 * kMs), 114 * kMs);
  EXPECT_EQ(MidExposure(100 * kMs, V4L2_BUF_FLAG_TSTAMP_SRC_EOF, 8 * kMs, 20 * kMs), 86 * kMs);
  // Another clock's stamp: by arrival.
  camera_->stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  shot.stamp_ns = 1'700'000'000'000'000'000;
  const Timestamp before = MonotonicNow();
  const Timestamp stamped = Take(shot)->capture_time_ns;
  EXPECT_GE(stamped, before - 4 * kMs);
  EXPECT_LE(stamped, MonotonicNow());
}

TEST_F(V4l2, CountsGapsTornAndLatePicturesAndSkipsThem) {
  Start();
  EXPECT_EQ(Take(Shot())->id, 0u);
  FakeCamera::Shot after_gap = Shot();
  after_gap.skipped = 3;
  EXPECT_EQ(Take(after_gap)->id, 4u);
  FakeCamera::Shot flagged = Shot(), cut = Shot(), late = Shot();
  flagged.flags = V4L2_BUF_FLAG_ERROR;
  cut.used = cut.bytes.size() - 2;
  late.stamp_ns = MonotonicNow() - 300 * kMs;
  ASSERT_TRUE(camera_->Push(flagged) && camera_->Push(cut) && camera_->WaitUntilDrained());
  EXPECT_EQ(Take(Shot())->id, 7u);
  EXPECT_EQ(source_->counts().dropped, 3u);
  EXPECT_EQ(source_->counts().torn, 2u);
  EXPECT_EQ(source_->counts().late, 0u);
  EXPECT_EQ(source_->bad_frames(), 2u);
  EXPECT_EQ(source_->dropped_frames(), 3u);
}

TEST_F(V4l2, CountsLatePictures) {
  Start();
  FakeCamera::Shot late = Shot();
  late.stamp_ns = MonotonicNow() - 300 * kMs;
  ASSERT_TRUE(Take(late));
  EXPECT_EQ(source_->counts().late, 1u);
  ASSERT_TRUE(Take(Shot()));
  EXPECT_EQ(source_->counts().late, 1u);
}

TEST_F(V4l2, TruncatedAndForeignJpegsAreTorn) {
  UseFormat(V4L2_PIX_FMT_MJPEG);
  Start();
  std::vector<std::uint8_t> cut = Jpeg(Scene());
  cut.resize(cut.size() / 2);
  cv::Mat small;
  cv::resize(Scene(), small, cv::Size(32, 24));
  auto next = std::async(std::launch::async, [this] { return source_->Next(); });
  for (const auto& bytes : {cut, Jpeg(small), Jpeg(Scene())}) {
    ASSERT_TRUE(camera_->Push({.bytes = bytes}) && camera_->WaitUntilDrained());
    const std::uint64_t known = source_->counts().torn;
    for (int i = 0; i < 500 && source_->counts().torn == known; ++i) {
      if (next.wait_for(std::chrono::milliseconds(2)) == std::future_status::ready) break;
    }
  }
  EXPECT_EQ((*next.get())->id, 2u);
  EXPECT_EQ(source_->counts().torn, 2u);
}

TEST_F(V4l2, SlowReaderGetsTheNewestAndTheDriversQueueStaysEmpty) {
  Start();
  ASSERT_TRUE(Take(Shot()));
  for (int i = 1; i <= 20; ++i) ASSERT_TRUE(camera_->Push(Shot(40 + i)));
  ASSERT_TRUE(camera_->WaitUntilDrained());
  // The last one's buffer is given back a moment before it is there for the reader.
  for (int i = 0; i < 2000 && source_->counts().superseded < 19; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const auto frame = source_->Next();
  ASSERT_TRUE(frame.ok() && *frame);
  EXPECT_EQ((*frame)->id, 20u);
  EXPECT_LT(MeanDifference((*frame)->color, Scene(60)), 4.0);
  EXPECT_EQ(source_->counts().superseded, 19u);
  EXPECT_EQ(source_->counts().dropped, 0u);
}

TEST_F(V4l2, UnpluggedCameraIsWaitedForAndGoesOn) {
  camera_->controls[V4L2_CID_FOCUS_AUTO] = {0, 1, 1};
  Start();
  const std::optional<Frame> before = Take(Shot());
  ::testing::internal::CaptureStderr();
  camera_->SetPlugged(false);
  auto next = std::async(std::launch::async, [this] { return source_->Next(); });
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(500)), std::future_status::timeout);
  EXPECT_EQ(camera_->closed(), 1);  // or the device would come back under another number
  {                                 // it comes back with its own defaults
    camera_->controls[V4L2_CID_FOCUS_AUTO] = {0, 1, 1};
    camera_->SetPlugged(true);
  }
  ASSERT_TRUE(camera_->Push(Shot(90)));
  const auto after = next.get();
  ASSERT_TRUE(after.ok() && *after);
  EXPECT_GT((*after)->id, before->id);
  EXPECT_GT((*after)->capture_time_ns, before->capture_time_ns);
  EXPECT_LT(MeanDifference((*after)->color, Scene(90)), 4.0);
  EXPECT_EQ(source_->counts().unplugged, 1u);
  EXPECT_EQ(camera_->opened(), 2);
  EXPECT_EQ(camera_->Value(V4L2_CID_FOCUS_AUTO), 0);
  (void)::testing::internal::GetCapturedStderr();
}

TEST_F(V4l2, CameraThatFallsSilentIsOpenedAnew) {
  Start();
  ASSERT_TRUE(Take(Shot()));
  for (int i = 0; i < 60 && camera_->opened() < 2; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_EQ(camera_->opened(), 2);
  EXPECT_TRUE(Take(Shot()));
}

TEST_F(V4l2, StopEndsAWaitingReaderWithAndWithoutTheCamera) {
  for (const bool plugged : {true, false}) {
    Start();
    ASSERT_TRUE(Take(Shot()));
    camera_->SetPlugged(plugged);
    auto next = std::async(std::launch::async, [this] { return source_->Next(); });
    EXPECT_EQ(next.wait_for(std::chrono::milliseconds(300)), std::future_status::timeout);
    source_->Stop();
    ASSERT_EQ(next.wait_for(std::chrono::seconds(1)), std::future_status::ready);
    const auto ended = next.get();
    EXPECT_TRUE(ended.ok() && !ended->has_value());
    EXPECT_TRUE(source_->Next().ok() && !source_->Next()->has_value());
    camera_->SetPlugged(true);
  }
}

}  // namespace
}  // namespace saccade::v4l2_test
