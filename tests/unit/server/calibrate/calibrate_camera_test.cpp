#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/calibrate/lens_report.hpp"
#include "tests/unit/server/calibrate/rendered_board.hpp"

namespace saccade::calibrate_camera_test {
namespace {

using testing::BoardCamera;
using ::testing::HasSubstr;
using testing::ShownBoard;

const BoardPattern kBoard{9, 6, 0.025};

CameraIntrinsics Narrow() {
  CameraIntrinsics lens;
  lens.model = LensModel::kBrownConrady;
  lens.width = 640;
  lens.height = 480;
  lens.fx = 517.3;
  lens.fy = 516.1;
  lens.cx = 318.6;
  lens.cy = 245.3;
  lens.distortion = {-0.28, 0.09, 0.0008, -0.0005, -0.01};
  return lens;
}

CameraIntrinsics Fisheye() {
  CameraIntrinsics lens = Narrow();
  lens.model = LensModel::kKannalaBrandt;
  lens.fx = 285.7;
  lens.fy = 286.4;
  lens.distortion = {-0.012, 0.035, -0.03, 0.006, 0};
  return lens;
}

ViewPicker Picked(const std::vector<cv::Mat>& pictures, cv::Size size) {
  ViewPicker picker(size);
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const auto corners = FindBoard(pictures[k], kBoard);
    if (!corners.empty())
      picker.Offer({k, static_cast<Timestamp>(k) * 1'000'000'000, corners, kBoard.Points()});
  }
  return picker;
}

std::vector<double> TruthOf(const CameraIntrinsics& lens) {
  std::vector<double> truth = {lens.fx, lens.fy, lens.cx, lens.cy};
  for (const double coefficient : lens.distortion) truth.push_back(coefficient);
  return truth;
}

class LensFromBoards : public ::testing::TestWithParam<unsigned> {
 protected:
  static void ExpectTruth(const CameraIntrinsics& lens) {
    const BoardCamera camera(lens, kBoard);
    const cv::Size size(lens.width, lens.height);
    const ViewPicker picker = Picked(ShownBoard(camera, kBoard, 40, 38, 2.0, GetParam()), size);
    const auto report = Calibrate("test", picker, kBoard.Words(), size, lens.model);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_TRUE(Judge(*report).ok()) << Judge(*report);
    const std::vector<double> truth = TruthOf(lens);
    for (std::size_t k = 0; k < report->fit.names.size(); ++k) {
      const double off = (report->fit.values[k] - truth[k]) / report->fit.sigmas[k];
      EXPECT_LT(std::abs(off), 3.0) << report->fit.names[k] << ": " << report->fit.values[k]
                                    << " is not " << truth[k] << " +- " << report->fit.sigmas[k];
    }
    // Sigmas that are worth having, not only wide ones.
    EXPECT_LT(report->fit.sigmas[0], 0.003 * lens.fx);
    EXPECT_LT(report->fit.sigmas[2], 0.003 * lens.width);
    EXPECT_LT(report->held_out_rms_px, 0.1);
    std::cout << ReportText(*report);
  }
};

TEST_P(LensFromBoards, BrownConradyIsFoundWithinThreeOfItsSigmas) { ExpectTruth(Narrow()); }
TEST_P(LensFromBoards, KannalaBrandtIsFoundWithinThreeOfItsSigmas) { ExpectTruth(Fisheye()); }
INSTANTIATE_TEST_SUITE_P(Seeds, LensFromBoards, ::testing::Values(1U, 2U, 3U, 4U));

absl::Status Verdict(const ViewPicker& picker) {
  const auto report =
      Calibrate("test", picker, kBoard.Words(), {640, 480}, LensModel::kBrownConrady);
  return report.ok() ? Judge(*report) : report.status();
}

TEST(CalibrateCamera, ABoardSeenStraightOnIsRefusedWithTheRemedy) {
  const BoardCamera camera(Narrow(), kBoard);
  for (const unsigned seed : {1U, 2U}) {
    const auto verdict = Verdict(Picked(ShownBoard(camera, kBoard, 40, 2, 2.0, seed), {640, 480}));
    EXPECT_EQ(verdict.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(verdict.message()), HasSubstr("tilt"));
  }
}

TEST(CalibrateCamera, FewViewsAreRefused) {
  const BoardCamera camera(Narrow(), kBoard);
  const auto verdict = Verdict(Picked(ShownBoard(camera, kBoard, 6, 38, 2.0, 1), {640, 480}));
  EXPECT_THAT(std::string(verdict.message()), HasSubstr("views"));
}

TEST(CalibrateCamera, ABadViewIsLeftOutAndNamed) {
  const BoardCamera camera(Narrow(), kBoard);
  ViewPicker picker = Picked(ShownBoard(camera, kBoard, 30, 38, 2.0, 5), {640, 480});
  std::vector<BoardView> views = picker.views();
  for (std::size_t k = 0; k < views[3].corners.size(); ++k) {
    views[3].corners[k].x += k % 2 == 0 ? 3 : -3;  // torn: two pictures in one
  }
  const auto fit = FitLens(views, {640, 480}, LensModel::kBrownConrady);
  ASSERT_TRUE(fit.ok()) << fit.status();
  EXPECT_TRUE(fit->views[3].rejected);
  EXPECT_GT(fit->views[3].rms_px, 1.0);
  EXPECT_NEAR(fit->lens.fx, Narrow().fx, 3.0 * fit->sigmas[0]);
}

TEST(ViewPicker, TakesWhatDiffersAndSaysWhatIsMissing) {
  ViewPicker picker({640, 480});
  EXPECT_THAT(picker.Advice(), HasSubstr("whole board"));
  const auto straight = [](double x, double y, double step) {
    std::vector<cv::Point2d> corners;
    for (int j = 0; j < kBoard.rows; ++j) {
      for (int i = 0; i < kBoard.columns; ++i) corners.emplace_back(x + step * i, y + step * j);
    }
    return corners;
  };
  EXPECT_EQ(picker.Offer({0, 0, straight(200, 150, 25), kBoard.Points()}),
            ViewPicker::Verdict::kTaken);
  EXPECT_EQ(picker.Offer({1, 1'000'000'000, straight(204, 150, 25), kBoard.Points()}),
            ViewPicker::Verdict::kAlike);
  EXPECT_THAT(picker.Advice(), HasSubstr("left edge"));
  // A thirtieth of a second later it is far away: it moves.
  EXPECT_EQ(picker.Offer({2, 1'033'000'000, straight(20, 150, 25), kBoard.Points()}),
            ViewPicker::Verdict::kMoving);
  EXPECT_EQ(picker.Offer({3, 1'066'000'000, straight(20, 150, 25), kBoard.Points()}),
            ViewPicker::Verdict::kTaken);
  EXPECT_THAT(picker.Advice(), HasSubstr("right edge"));
  EXPECT_FALSE(picker.Complete());
}

TEST(Board, IsReadOrRefusedWithWhatToCount) {
  EXPECT_EQ(ParseBoard("9x6", 0.025)->columns, 9);
  for (const char* board : {"9", "9x", "2x6", "ax6", "9x6x1", "-9x6"}) {
    EXPECT_THAT(std::string(ParseBoard(board, 0.025).status().message()),
                HasSubstr("inner corners"))
        << board;
  }
  EXPECT_THAT(std::string(ParseBoard("9x6", 25).status().message()), HasSubstr("metres"));
}

}  // namespace
}  // namespace saccade::calibrate_camera_test
