#include "server/calibrate/live_calibration.hpp"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <future>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <thread>

#include "server/calibrate/calibration_desk.hpp"
#include "server/capture/camera_file.hpp"
#include "server/markers/tag_family.hpp"

namespace saccade::live_calibration_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kFocal_px = 590.0;
const cv::Size kPicture(640, 480);

/// A printed sheet: its picture, and where its origin and axes are in it.
struct Sheet {
  cv::Mat print;
  double px_per_m = 0;
  cv::Point2d origin_px;  // of the target's own origin
  bool y_up = false;      // of the target's own y
  cv::Size2d size_m;
};

Sheet CharucoSheet() {
  const auto board = cv::aruco::CharucoBoard::create(
      7, 5, 0.04F, 0.03F, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50));
  Sheet sheet{{}, 2500, {0, 500}, true, {0.28, 0.2}};
  board->draw({700, 500}, sheet.print, 0, 1);
  return sheet;
}

/// A grid of markers, drawn one by one into the places `corner` says (upper left, print pixels).
Sheet GridSheet(int dictionary, int columns, int rows, double side_m, double gap_m, int border) {
  Sheet sheet{{}, 2500, {}, false, {}};
  const int side = static_cast<int>(std::lround(side_m * sheet.px_per_m));
  const int pitch = static_cast<int>(std::lround((side_m + gap_m) * sheet.px_per_m)), edge = 40;
  sheet.print.create(2 * edge + rows * pitch, 2 * edge + columns * pitch, CV_8UC1);
  sheet.print.setTo(255);
  const auto codes = cv::aruco::getPredefinedDictionary(dictionary);
  for (int id = 0; id < columns * rows; ++id) {
    cv::Mat marker;
    cv::aruco::drawMarker(codes, id, side, marker, border);
    const int row = id / columns;
    const cv::Point at(edge + id % columns * pitch, edge + row * pitch);
    marker.copyTo(sheet.print(cv::Rect(at, marker.size())));
  }
  sheet.origin_px = {edge - 0.5, edge - 0.5};
  sheet.size_m = {columns * (side_m + gap_m), rows * (side_m + gap_m)};
  return sheet;
}

/// Kalibr's: ids rise from the lower left, small black squares where the corners of four meet.
Sheet AprilGridSheet() {
  constexpr int kColumns = 5, kRows = 4, kSide = 100, kGap = 30, kPitch = kSide + kGap, kEdge = 40;
  Sheet sheet{{}, 2500, {kEdge - 0.5, kEdge + kRows * kPitch - kGap - 0.5}, true, {}};
  sheet.print.create(2 * kEdge + kRows * kPitch - kGap, 2 * kEdge + kColumns * kPitch - kGap,
                     CV_8UC1);
  sheet.print.setTo(255);
  const auto family = TagFamily::Make("apriltag36h11", 2);
  for (int id = 0; id < kColumns * kRows; ++id) {
    cv::Mat cells = cv::Mat::zeros(family->cells(), family->cells(), CV_8UC1);
    for (const TagFamily::Bit& bit : family->Bits(id)) {
      cells.at<std::uint8_t>(bit.row, bit.column) = bit.bright ? 255 : 0;
    }
    const cv::Rect at(kEdge + id % kColumns * kPitch, kEdge + (kRows - 1 - id / kColumns) * kPitch,
                      kSide, kSide);
    cv::resize(cells, sheet.print(at), at.size(), 0, 0, cv::INTER_NEAREST);
  }
  for (int row = 0; row <= kRows; ++row) {
    for (int column = 0; column <= kColumns; ++column) {
      sheet.print(cv::Rect(kEdge + column * kPitch - kGap, kEdge + row * kPitch - kGap, kGap, kGap))
          .setTo(0);
    }
  }
  sheet.size_m = {(kColumns * kPitch - kGap) / sheet.px_per_m,
                  (kRows * kPitch - kGap) / sheet.px_per_m};
  return sheet;
}

/// As a pinhole camera sees the sheet from somewhere.
cv::Mat Seen(const Sheet& sheet, const cv::Vec3d& turn, const cv::Vec3d& middle_m) {
  constexpr int kLarger = 3;
  cv::Matx33d r;
  cv::Rodrigues(turn, r);
  const double half_x = 0.5 * sheet.size_m.width, half_y = 0.5 * sheet.size_m.height;
  const double f = kFocal_px;
  const cv::Matx33d k(f, 0, 0.5 * (kPicture.width - 1), 0, f, 0.5 * (kPicture.height - 1), 0, 0, 1);
  // Print pixels to metres about the sheet's middle, x right, y down.
  const double m = 1 / sheet.px_per_m;
  const cv::Matx33d metres(m, 0, -half_x - m * (sheet.origin_px.x), 0, m,
                           (sheet.y_up ? half_y : -half_y) - m * (sheet.origin_px.y), 0, 0, 1);
  const cv::Matx33d pose(r(0, 0), r(0, 1), middle_m[0], r(1, 0), r(1, 1), middle_m[1], r(2, 0),
                         r(2, 1), middle_m[2]);
  const cv::Matx33d larger(kLarger, 0, 0.5 * (kLarger - 1), 0, kLarger, 0.5 * (kLarger - 1), 0, 0,
                           1);
  cv::Mat seen;
  cv::warpPerspective(sheet.print, seen, larger * k * pose * metres, kPicture * kLarger,
                      cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::resize(seen, seen, kPicture, 0, 0, cv::INTER_AREA);
  return seen;
}

struct Case {
  const char* name;
  const char* target;
  Sheet (*sheet)();
};

class LiveTargets : public ::testing::TestWithParam<Case> {};

// Eight views at places and tilts such as people show them.
TEST_P(LiveTargets, TheLensIsFoundAndSoIsWhatIsMissing) {
  auto target = MakeLensTarget(GetParam().target);
  ASSERT_TRUE(target.ok()) << target.status();
  LiveCalibration live(*std::move(target), kPicture);
  const cv::Mat nothing(kPicture, CV_8UC1, cv::Scalar(200));
  const auto missing = live.Offer(0, 1, nothing);
  EXPECT_FALSE(missing.verdict);
  EXPECT_THAT(missing.next, AllOf(HasSubstr("in view"), HasSubstr("without glare")));
  const Sheet sheet = GetParam().sheet();
  int k = 1;
  for (const double tilt : {-0.55, 0.55}) {
    for (const cv::Vec3d& turn : {cv::Vec3d(tilt, 0.1, 0), cv::Vec3d(0.1, tilt, 0.2)}) {
      for (const cv::Vec3d& at : {cv::Vec3d(-0.07, -0.05, 0.42), cv::Vec3d(0.07, 0.04, 0.46)}) {
        live.Offer(k, k * 1'000'000'000LL, Seen(sheet, turn, at));
        ++k;
      }
    }
  }
  ASSERT_GE(live.picker().views().size(), 7U);
  EXPECT_FALSE(live.picker().Advice().empty());
  const auto report = live.Fit("test", {"brown_conrady"});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_LT(report->fit.rms_px, 0.15);
  EXPECT_NEAR(report->fit.lens.fx, kFocal_px, 0.005 * kFocal_px);
  EXPECT_NEAR(report->fit.lens.fx, kFocal_px, 3.5 * report->fit.sigmas[0]);
  EXPECT_EQ(report->board, live.target().words());
}

INSTANTIATE_TEST_SUITE_P(
    All, LiveTargets,
    ::testing::Values(Case{"Charuco", "charuco:7x5:0.04:0.03", CharucoSheet},
                      Case{"AprilGrid", "aprilgrid:5x4:0.04:0.3", AprilGridSheet},
                      Case{
                          "ArucoGrid", "arucogrid:5x4:0.04:0.012:aruco_6x6_250",
                          [] { return GridSheet(cv::aruco::DICT_6X6_250, 5, 4, 0.04, 0.012, 1); }}),
    [](const auto& test) { return test.param.name; });

// Of an AprilGrid real pictures: of EuRoC's camera, whose makers say fx 458.654.
TEST(LiveCalibration, AnAprilGridThatIsShown) {
  const std::filesystem::path folder = SACCADE_SOURCE_DIR "/../shared/data/calib_euroc";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no ../shared/data/calib_euroc here";
  std::vector<std::string> files;
  cv::glob((folder / "*.jpg").string(), files);
  auto target = MakeLensTarget("aprilgrid:6x6:0.088:0.3");
  ASSERT_TRUE(target.ok()) << target.status();
  std::optional<LiveCalibration> live;
  for (std::size_t k = 0; k < files.size(); k += 3) {
    const cv::Mat grey = cv::imread(files[k], cv::IMREAD_GRAYSCALE);
    if (!live) live.emplace(*std::move(target), grey.size());
    live->Offer(k, static_cast<Timestamp>(k) * 1'000'000'000, grey);
  }
  const auto report = live->Fit("test", {"brown_conrady"});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_LT(report->fit.rms_px, 0.2);
  EXPECT_NEAR(report->fit.lens.fx, 458.654, 0.01 * 458.654);  // of a third of the pictures
}

/// Waits for what the desk's thread does; a minute is a machine that does nothing else.
template <typename Condition>
bool Soon(const Condition& condition) {
  for (int k = 0; k < 6000; ++k) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

absl::Status Answer(const std::function<void(DoneEmpty)>& ask) {
  std::promise<absl::Status> answer;
  ask([&](const absl::Status& status) { answer.set_value(status); });
  return answer.get_future().get();
}

std::shared_ptr<const Frame> FrameOf(FrameId id, const cv::Mat& grey) {
  CameraIntrinsics lens;
  lens.width = kPicture.width, lens.height = kPicture.height;
  lens.fx = lens.fy = 600, lens.cx = 320, lens.cy = 240;
  lens.fps = 25;
  auto frame = std::make_shared<Frame>();
  frame->id = id;
  frame->capture_time_ns = static_cast<Timestamp>(id) * 1'000'000'000;
  frame->grey = grey;
  frame->camera = std::make_shared<const CameraModel>(lens);
  return frame;
}

TEST(CalibrationDesk, CalibratesFromTheFramesOfAServerAndKeepsWhatIsBelieved) {
  using Phase = CalibrationState::Phase;
  const auto keep_as = std::filesystem::path(::testing::TempDir()) /
                       absl::StrCat("saccade_desk_", getpid()) / "cameras/camera.yaml";
  std::atomic<bool> paused = false;
  CalibrationDesk desk({"test", keep_as, [&](FrameId) { return !paused; }});
  const auto start = [&](const std::string& target, const std::string& lens) {
    return Answer([&](DoneEmpty done) { desk.StartCalibration(target, lens, std::move(done)); });
  };
  EXPECT_EQ(desk.File("saccade").status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(start("dots:3x3", "").message()), HasSubstr("is none"));
  EXPECT_THAT(std::string(start("aprilgrid:/etc/passwd", "").message()), HasSubstr("a file"));
  EXPECT_THAT(std::string(start("charuco:7x5:0.04:0.03", "plain").message()), HasSubstr("lens"));
  EXPECT_FALSE(Answer([&](DoneEmpty done) { desk.FinishCalibration(std::move(done)); }).ok());
  ASSERT_TRUE(start("charuco:7x5:0.04:0.03", "brown_conrady").ok());
  EXPECT_EQ(desk.state()->phase, Phase::kShowing);
  const Sheet sheet = CharucoSheet();
  FrameId id = 1;
  bool seen = false;
  for (const double x : {-0.13, -0.05, 0.05, 0.13}) {
    for (const double y : {-0.08, 0.0, 0.08}) {
      const cv::Vec3d turn(y < 0 ? 0.5 : -0.5, x < 0 ? -0.45 : 0.45, 0.1);
      desk.OnFrame(FrameOf(id, Seen(sheet, turn, {x, y, id % 2 == 0 ? 0.4 : 0.5})));
      ASSERT_TRUE(
          Soon([&] { return desk.state()->picture && desk.state()->picture->frame == id; }));
      seen = seen || !desk.state()->picture->corners_px.empty();
      ++id;
    }
  }
  EXPECT_TRUE(seen);
  const auto shown = desk.state();
  EXPECT_GE(shown->views, 8);
  EXPECT_EQ(shown->picture->jpeg.substr(0, 2), "\xff\xd8");
  paused = true;
  EXPECT_EQ(desk.state()->picture, nullptr);
  paused = false;
  ASSERT_TRUE(Answer([&](DoneEmpty done) { desk.FinishCalibration(std::move(done)); }).ok());
  ASSERT_TRUE(Soon([&] { return desk.state()->phase == Phase::kDone; })) << desk.state()->problem;
  const auto done = desk.state();
  EXPECT_EQ(done->result->doubt, "");
  EXPECT_NEAR(done->result->parameters[0].value, kFocal_px, 0.01 * kFocal_px);
  EXPECT_GT(done->result->parameters[0].sigma, 0);
  EXPECT_FALSE(done->result->residuals_px.empty());
  EXPECT_EQ(done->result->residuals_px.size() % 4, 0U);
  for (const char* form : {"saccade", "kalibr", "ros", "opencv"}) {
    const auto file = desk.File(form);
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_THAT(file->text, HasSubstr("one sigma: fx"));
  }
  std::promise<absl::StatusOr<std::string>> saved;
  desk.SaveCalibration([&](absl::StatusOr<std::string> file) { saved.set_value(std::move(file)); });
  const auto file = saved.get_future().get();
  ASSERT_TRUE(file.ok()) << file.status();
  const auto camera = LoadCamera(*file);
  ASSERT_TRUE(camera.ok()) << camera.status();
  EXPECT_EQ(camera->fx, done->result->parameters[0].value);
  EXPECT_EQ(camera->fps, 25);
  std::filesystem::remove_all(keep_as.parent_path().parent_path());
  ASSERT_TRUE(Answer([&](DoneEmpty stopped) { desk.StopCalibration(std::move(stopped)); }).ok());
  EXPECT_EQ(desk.state()->phase, Phase::kIdle);
  EXPECT_FALSE(desk.File("saccade").ok());
}

TEST(LensTarget, WhatIsNoneIsRefusedWithWhatToWrite) {
  const auto error = [](const std::string& text) {
    return std::string(MakeLensTarget(text).status().message());
  };
  EXPECT_THAT(error("dots:9x6"), AllOf(HasSubstr("'dots:9x6' is none"), HasSubstr("charuco:7x5")));
  EXPECT_THAT(error("chessboard:2x6:0.04"), HasSubstr("inner corners"));
  EXPECT_THAT(error("charuco:7x5:0.03:0.04"), HasSubstr("target: "));
  EXPECT_THAT(error("aprilgrid:6x6:0.088"), HasSubstr("as in 6x6:0.088:0.3"));
  EXPECT_THAT(error("arucogrid:5x7:0.04"), HasSubstr("arucogrid:5x7:0.04:0.01:aruco_6x6_250"));
  EXPECT_THAT(error("arucogrid:5x7:0.04:0.01:aruco_9x9"), HasSubstr("aruco_6x6_250"));
}

}  // namespace
}  // namespace saccade::live_calibration_test
