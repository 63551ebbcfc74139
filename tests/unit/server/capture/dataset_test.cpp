#include "server/capture/dataset.hpp"

#include <gmock/gmock.h>

#include <thread>

#include "shared/io/log.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::dataset_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Dataset : public DatasetFixture {
 protected:
  std::unique_ptr<FrameSource> Open(const SourceOptions& options = {}) const {
    auto source = OpenDataset(folder_, options);
    EXPECT_TRUE(source.ok()) << source.status();
    return source.ok() ? *std::move(source) : nullptr;
  }
  static std::vector<FrameId> Ids(FrameSource& source) {
    std::vector<FrameId> ids;
    while (true) {
      auto frame = source.Next();
      EXPECT_TRUE(frame.ok());
      if (!frame.ok() || !*frame) return ids;
      ids.push_back((*frame)->id);
    }
  }
  std::string Error(const SourceOptions& options = {}) const {
    return std::string(OpenDataset(folder_, options).status().message());
  }
};

TEST_F(Dataset, DeliversEveryFrameWithItsStampAndPicture) {
  auto source = Open();
  EXPECT_EQ(source->info().frame_count, 6);
  EXPECT_FALSE(source->info().target);
  for (int i = 0; i < kFrames; ++i) {
    const auto frame = source->Next();
    ASSERT_TRUE(frame.ok() && *frame);
    EXPECT_EQ((*frame)->id, i);
    EXPECT_EQ((*frame)->capture_time_ns, 10'000'000'000 + i * 10'000'000);
    EXPECT_EQ((*frame)->source_timestamp, "10.0" + std::to_string(i) + "0000");
    EXPECT_NEAR(cv::mean((*frame)->grey)[0], cv::mean(PictureOf(i))[0], 1.0);
    EXPECT_TRUE((*frame)->color.empty());
    EXPECT_EQ((*frame)->camera, source->info().camera);
  }
  EXPECT_FALSE(*source->Next());
  EXPECT_FALSE(*source->Next());
  EXPECT_EQ(source->bad_frames(), 0);
}

TEST_F(Dataset, ColourPicturesComeWithTheirGrey) {
  cv::imwrite(PicturePath(0).string(), cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(0, 0, 255)));
  const auto frame = Open()->Next();
  ASSERT_TRUE(frame.ok() && *frame);
  EXPECT_EQ((*frame)->color.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 255));
  EXPECT_EQ((*frame)->grey.at<std::uint8_t>(0, 0), 76);
}

TEST_F(Dataset, BadPicturesAreSkippedCountedAndKeepTheirId) {
  std::filesystem::remove(PicturePath(0));
  Truncate(PicturePath(1), 0.7);  // JPEG
  Truncate(PicturePath(2), 0.7);  // PNG
  Write("rgb/3.jpg", "not a picture");
  Write("rgb/4.png", "");
  auto source = Open();
  FlushLog(std::chrono::seconds(5));  // of the tests before
  ::testing::internal::CaptureStderr();
  EXPECT_THAT(Ids(*source), ElementsAre(5));
  FlushLog(std::chrono::seconds(5));
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(source->bad_frames(), 5);
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 5) << said;
  EXPECT_THAT(said, AllOf(HasSubstr("frame 0 skipped"), HasSubstr("rgb/1.jpg: the JPEG is trunc"),
                          HasSubstr("rgb/2.png: the PNG is truncated"), HasSubstr("rgb/4.png")));
}

TEST_F(Dataset, EveryTruncationOfAPictureIsNoticed) {
  for (int i : {1, 2}) {
    const std::string whole = [&] {
      std::ifstream file(PicturePath(i), std::ios::binary);
      return std::string(std::istreambuf_iterator<char>(file), {});
    }();
    for (std::size_t size = 0; size < whole.size() - 12; size += 7) {
      std::ofstream(PicturePath(i), std::ios::binary) << whole.substr(0, size);
      SourceOptions options;
      options.first_frame = i;
      options.end_frame = i + 1;
      ASSERT_EQ(OpenDataset(folder_, options).status().code(), absl::StatusCode::kDataLoss)
          << i << " at " << size;
    }
  }
}

TEST_F(Dataset, FrameRangeIsHalfOpenAndKeepsPositions) {
  SourceOptions options;
  options.first_frame = 2;
  options.end_frame = 4;
  auto source = Open(options);
  EXPECT_EQ(source->info().frame_count, 2);
  EXPECT_THAT(Ids(*source), ElementsAre(2, 3));
  options.end_frame = 2;
  EXPECT_THAT(Error(options), AllOf(HasSubstr("frames 2:2 is empty"), HasSubstr("0:6")));
  options.first_frame = 6;
  options.end_frame.reset();
  EXPECT_THAT(Error(options), HasSubstr("is empty"));
}

TEST_F(Dataset, StartPoseAndHintHoldForFrameZeroOnly) {
  Write("start.yaml",
        "position_m: [0, 0, -0.6]\nposition_sigma_m: 0.02\norientation_xyzw: [0, 0, 0, 1]\n"
        "orientation_sigma_rad: 0\n");
  Write("target.yaml",
        "type: chessboard\ncolumns: 9\nrows: 6\nsquare_m: 0.04\nhint_px: [1, 2, 3, 4, 5, 6]\n");
  EXPECT_TRUE(Open()->info().start);
  EXPECT_TRUE(std::get<ChessboardTarget>(*Open()->info().target).hint_px);
  SourceOptions later;
  later.first_frame = 1;
  EXPECT_FALSE(Open(later)->info().start);
  EXPECT_FALSE(std::get<ChessboardTarget>(*Open(later)->info().target).hint_px);
}

TEST_F(Dataset, WrongSizeIsToldAtOnce) {
  Write("camera.yaml",
        "model: pinhole\nwidth: 640\nheight: 480\nfx: 600\nfy: 600\ncx: 320\ncy: 240\n");
  EXPECT_THAT(Error(), AllOf(HasSubstr("is 64x48"), HasSubstr("says 640x480")));
}

TEST_F(Dataset, OtherSizeLaterIsABadFrame) {
  cv::imwrite(PicturePath(3).string(), cv::Mat(20, 20, CV_8UC1, cv::Scalar(1)));
  auto source = Open();
  EXPECT_THAT(Ids(*source), ElementsAre(0, 1, 2, 4, 5));
  EXPECT_EQ(source->bad_frames(), 1);
}

TEST_F(Dataset, MissingPartsAreNamed) {
  EXPECT_THAT(OpenDataset(folder_ / "nowhere", {}).status().message(),
              AllOf(HasSubstr("nowhere"), HasSubstr("no such folder")));
  std::filesystem::remove(folder_ / "camera.yaml");
  EXPECT_THAT(Error(), HasSubstr("camera.yaml"));
  std::filesystem::remove(folder_ / "rgb.txt");
  EXPECT_THAT(Error(), HasSubstr("rgb.txt"));
  std::filesystem::create_directory(folder_ / "mav0");
  EXPECT_THAT(Error(), AllOf(HasSubstr("mav0/cam0/data.csv"), HasSubstr("EuRoC")));
}

TEST_F(Dataset, ALensMayBeAssumedWhereItIsAskedFor) {
  EXPECT_FALSE(Open()->info().lens_assumed);
  SourceOptions wide;
  wide.view_deg = 90;
  const auto told = OpenDataset(folder_, wide);
  ASSERT_TRUE(told.ok()) << told.status();
  EXPECT_TRUE((*told)->info().lens_assumed);
  EXPECT_NEAR((*told)->info().camera->intrinsics().fx, 32.0, 1e-9);  // 64 px across
  EXPECT_THAT((*told)->info().remark, HasSubstr("90 deg"));
  std::filesystem::remove(folder_ / "camera.yaml");
  EXPECT_THAT(Error(), HasSubstr("camera.yaml"));
  SourceOptions missing;
  missing.lens_may_be_missing = true;
  const auto assumed = OpenDataset(folder_, missing);
  ASSERT_TRUE(assumed.ok()) << assumed.status();
  EXPECT_TRUE((*assumed)->info().lens_assumed);
  EXPECT_NEAR((*assumed)->info().camera->intrinsics().fx, 55.426, 1e-3);
  EXPECT_NEAR((*assumed)->info().camera->intrinsics().fps, 100.0, 1e-6);
}

TEST_F(Dataset, NothingDecodableIsDataLoss) {
  for (int i = 0; i < kFrames; ++i) std::filesystem::remove(PicturePath(i));
  const auto source = OpenDataset(folder_, {});
  EXPECT_EQ(source.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(source.status().message(), HasSubstr("no picture can be decoded"));
}

TEST_F(Dataset, RealtimeKeepsTheRecordingsPace) {
  SourceOptions options;
  options.realtime = true;
  auto source = Open(options);
  const Timestamp begin = MonotonicNow();
  EXPECT_THAT(Ids(*source).back(), 5);
  EXPECT_GE(MonotonicNow() - begin, 50'000'000);  // 5 intervals of 10 ms
}

TEST_F(Dataset, RealtimeGivesALateReaderTheNewest) {
  SourceOptions options;
  options.realtime = true;
  auto source = Open(options);
  ASSERT_EQ((*source->Next())->id, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_THAT(Ids(*source), ElementsAre(5));
  EXPECT_EQ(source->bad_frames(), 0);
}

TEST_F(Dataset, APauseIsToldWithItsLineAndNobodyWaitsForAnHour) {
  Write("rgb.txt", "# head\n0 rgb/0.png\n0.01 rgb/1.jpg\n3600.02 rgb/2.png\n3600.03 rgb/3.jpg\n");
  SourceOptions options;
  options.realtime = true;
  ::testing::internal::CaptureStderr();
  auto source = Open(options);
  FlushLog(std::chrono::seconds(2));
  EXPECT_THAT(::testing::internal::GetCapturedStderr(),
              AllOf(HasSubstr("rgb.txt:4: a pause of 3600.01 s"), HasSubstr("frame 2"),
                    HasSubstr("tracking starts anew")));
  const Timestamp begin = MonotonicNow();
  auto frame = source->Next();
  for (int i = 0; i < 2; ++i) frame = source->Next();
  EXPECT_EQ((*frame)->id, 2);
  EXPECT_EQ((*frame)->capture_time_ns, 3'600'020'000'000) << "the stamp is the recording's own";
  EXPECT_GT(Seconds(MonotonicNow() - begin), 4.9);
  EXPECT_LT(Seconds(MonotonicNow() - begin), 8.0);
}

TEST_F(Dataset, StopEndsAWaitingReader) {
  Write("rgb.txt", "0 rgb/0.png\n3600 rgb/1.jpg\n");
  SourceOptions options;
  options.realtime = true;
  auto source = Open(options);
  ASSERT_EQ((*source->Next())->id, 0);
  const Timestamp begin = MonotonicNow();
  std::jthread stopper([&] { source->Stop(); });
  EXPECT_FALSE(*source->Next());
  EXPECT_LT(Seconds(MonotonicNow() - begin), 5.0);
}

TEST_F(Dataset, MayBeDroppedHalfRead) {
  auto source = Open();
  ASSERT_TRUE(*source->Next());
  source.reset();  // joins its thread
  Open();          // never read at all
}

TEST_F(Dataset, SchemesThatDoNotExistAreToldWithThoseThatDo) {
  EXPECT_TRUE(OpenSource("dataset:" + folder_.string(), {}).ok());
  const auto unknown = OpenSource("gopher:there", {});
  EXPECT_EQ(unknown.status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(unknown.status().message(), AllOf(HasSubstr("gopher"), HasSubstr("dataset:")));
  EXPECT_EQ(OpenSource("/some/folder", {}).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Recordings, EveryOneOpens) {
  const std::filesystem::path root = SACCADE_SOURCE_DIR "/../shared/data";
  if (!std::filesystem::exists(root)) GTEST_SKIP() << "../shared/data is not here";
  for (const char* name :
       {"davison_desk", "tum_fr1_xyz", "checkerboard", "apriltag_corner", "hall_imu"}) {
    if (!std::filesystem::exists(root / name)) continue;
    const auto source = OpenDataset(root / name, {});
    ASSERT_TRUE(source.ok()) << source.status();
    const auto frame = (*source)->Next();
    ASSERT_TRUE(frame.ok() && *frame) << name;
    EXPECT_GT((*source)->info().frame_count, 100);
  }
}

}  // namespace
}  // namespace saccade::dataset_test
