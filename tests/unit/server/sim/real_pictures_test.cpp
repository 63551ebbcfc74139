// What real pictures have and the plain simulator lacks: each effect does what it says.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tests/unit/server/sim/open_sim.hpp"

namespace saccade::real_pictures_test {
namespace {

cv::Mat Clean(const std::string& rest, FrameId frame) {
  const std::unique_ptr<SimSource> source = OpenSim(rest);
  if (source == nullptr) return {};
  absl::StatusOr<cv::Mat> picture = source->RenderClean(frame);
  EXPECT_TRUE(picture.ok()) << picture.status();
  cv::Mat grey;
  cv::cvtColor(*picture, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(grey, CV_32F);
  return grey;
}

cv::Mat Captured(const std::string& rest, FrameId frame) {
  const std::unique_ptr<SimSource> source = OpenSim(rest, Frames(frame, frame + 1));
  if (source == nullptr) return {};
  const auto taken = source->Next();
  EXPECT_TRUE(taken.ok() && taken->has_value());
  return (*taken)->color;
}

double Contrast(const cv::Mat& grey) {
  cv::Scalar mean, sigma;
  cv::meanStdDev(grey, mean, sigma);
  return sigma[0];
}

double Edges(const cv::Mat& grey) {
  cv::Mat edges;
  cv::Laplacian(grey, edges, CV_32F);
  return cv::norm(edges);
}

// Small pictures: drawing is all that this test's time goes to.
const std::string kSmall = "desk?width=320&height=240&auto_exposure=off&blur=off&seed=3";

TEST(RealPictures, RepeatForTheirSeedAndDifferForAnother) {
  const std::string real = "desk?real=on&width=320&height=240&motion=walk";
  const cv::Mat once = Captured(real + "&seed=3", 45), again = Captured(real + "&seed=3", 45);
  const cv::Mat other = Captured(real + "&seed=4", 45);
  EXPECT_EQ(cv::norm(once, again, cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(once, other, cv::NORM_L1) / static_cast<double>(once.total()), 5);
}

TEST(RealPictures, VignettingDarkensTheCornersByItsShare) {
  const cv::Mat none = Clean(kSmall + "&vignetting=0", 5);
  const cv::Mat strong = Clean(kSmall + "&vignetting=0.4", 5);
  const auto ratio = [&](const cv::Rect& where) {
    return cv::mean(strong(where))[0] / cv::mean(none(where))[0];
  };
  EXPECT_NEAR(ratio({150, 110, 20, 20}), 1.0, 0.01);
  EXPECT_NEAR(ratio({0, 0, 8, 8}), 0.6, 0.05);
  EXPECT_NEAR(ratio({312, 232, 8, 8}), 0.6, 0.05);
}

TEST(RealPictures, TheToldLensIsOffByLensErrorInTheCorners) {
  for (const char* lens : {"pinhole", "brown_conrady"}) {
    const std::unique_ptr<SimSource> source =
        OpenSim(std::string("desk?lens_error_px=1.5&lens=") + lens);
    ASSERT_NE(source, nullptr);
    const CameraModel& told = *source->info().camera;
    for (const Eigen::Vector2d& corner : {Eigen::Vector2d(5, 5), Eigen::Vector2d(634, 474)}) {
      const auto seen = source->true_camera().Project(*told.Unproject(corner));
      ASSERT_TRUE(seen);
      EXPECT_NEAR((*seen - corner).norm(), 1.5, 0.4) << lens;
    }
    const auto middle = source->true_camera().Project(*told.Unproject({323, 237}));
    EXPECT_LT((*middle - Eigen::Vector2d(323, 237)).norm(), 0.02) << lens;
    // Pictures and truth are of the true lens.
    const auto point = source->PointAt(0, {20, 20});
    ASSERT_TRUE(point);
    EXPECT_LT((*source->PixelOf(0, *point) - Eigen::Vector2d(20, 20)).norm(), 0.01);
  }
}

TEST(RealPictures, RollingShutterShowsEachRowAtItsOwnTime) {
  // At 110 deg/s and 458 px / rad, 20 ms from the first row to the last are up to 18 px.
  const std::unique_ptr<SimSource> rolling =
      OpenSim("desk?motion=turn&rolling_shutter_ms=20&blur=off&auto_exposure=off");
  const std::unique_ptr<SimSource> global = OpenSim("desk?motion=turn&blur=off&auto_exposure=off");
  ASSERT_TRUE(rolling && global);
  FrameId turning = 0;
  double fastest = 0;
  for (FrameId k = 30; k < 120; ++k) {
    const double angle = RotationAngle(global->WorldFromCamera(k), global->WorldFromCamera(k + 1));
    if (angle > fastest) {
      fastest = angle;
      turning = k;
    }
  }
  const auto grey = [](const absl::StatusOr<cv::Mat>& picture) {
    cv::Mat made;
    cv::cvtColor(*picture, made, cv::COLOR_BGR2GRAY);
    made.convertTo(made, CV_32F);
    return made;
  };
  const cv::Mat a = grey(rolling->RenderClean(turning)), b = grey(global->RenderClean(turning));
  const auto shift = [&](int top) {
    const cv::Rect strip(0, top, 640, 64);
    return cv::phaseCorrelate(b(strip), a(strip)).x;
  };
  const double expected = fastest * 30 * 0.020 * (416 - 32) / 480 * 458;  // between the strips
  EXPECT_NEAR(std::abs(shift(416) - shift(0)), expected, 0.35 * expected);
  EXPECT_LT(std::abs(shift(208)), 1.5) << "the middle row is exposed when the stamp says";
}

TEST(RealPictures, FrameTimesAreUnevenAndTheStampsSaySo) {
  const std::unique_ptr<SimSource> source = OpenSim("desk?motion=walk&jitter_ms=3");
  ASSERT_NE(source, nullptr);
  double sum2 = 0;
  Timestamp before = -1;
  constexpr int kFrames = 400;
  for (FrameId k = 0; k < kFrames; ++k) {
    const SimTruth truth = source->Truth(k);
    EXPECT_GT(truth.capture_time_ns, before);
    before = truth.capture_time_ns;
    const double off_s = Seconds(truth.capture_time_ns) - static_cast<double>(k) / 30;
    sum2 += off_s * off_s;
    const Rigid3 there = source->WorldFromCameraAt(truth.capture_time_ns);
    EXPECT_LT((there.translation - truth.world_from_camera.translation).norm(), 1e-6);
  }
  EXPECT_NEAR(std::sqrt(sum2 / kFrames), 0.003, 0.0005);
}

TEST(RealPictures, CompressionLeavesItsBlocks) {
  const cv::Mat fine = Captured(kSmall, 5), coarse = Captured(kSmall + "&jpeg=60", 5);
  const auto blocks = [](const cv::Mat& color) {
    cv::Mat grey;
    cv::cvtColor(color, grey, cv::COLOR_BGR2GRAY);
    double at = 0, between = 0;
    for (int v = 0; v < grey.rows; ++v) {
      for (int u = 1; u < grey.cols; ++u) {
        const double step = std::abs(grey.at<std::uint8_t>(v, u) - grey.at<std::uint8_t>(v, u - 1));
        (u % 8 == 0 ? at : between) += u % 8 == 0 ? step : step / 7;
      }
    }
    return at / between;
  };
  EXPECT_NEAR(blocks(fine), 1.0, 0.05);
  EXPECT_GT(blocks(coarse), 1.1);
}

TEST(RealPictures, HazeAndSoftnessTakeWhatTheySay) {
  const cv::Mat plain = Clean(kSmall, 5);
  EXPECT_NEAR(Contrast(Clean(kSmall + "&contrast=0.5", 5)) / Contrast(plain), 0.5, 0.03);
  EXPECT_LT(Edges(Clean(kSmall + "&softness_px=1.5", 5)), 0.5 * Edges(plain));
}

TEST(RealPictures, GainFollowsTheScene) {
  const std::string walk = "desk?motion=walk&width=320&height=240&blur=off&seed=3&auto_exposure=";
  const std::unique_ptr<SimSource> fixed = OpenSim(walk + "off"),
                                   following = OpenSim(walk + "scene");
  ASSERT_TRUE(fixed && following);
  std::vector<double> a, b;
  for (FrameId k = 60; k < 300; k += 20) {
    a.push_back(std::log(cv::mean(*fixed->RenderClean(k))[1]));
    b.push_back(std::log(cv::mean(*following->RenderClean(k))[1]));
  }
  const auto spread = [](const std::vector<double>& values) {
    cv::Scalar mean, sigma;
    cv::meanStdDev(values, mean, sigma);
    return sigma[0];
  };
  EXPECT_LT(spread(b), 0.85 * spread(a)) << "pictures get more alike in brightness";
  // Whatever was drawn before: the gain of a frame is its own.
  const std::unique_ptr<SimSource> fresh = OpenSim(walk + "scene");
  EXPECT_EQ(cv::norm(*fresh->RenderClean(240), *following->RenderClean(240), cv::NORM_INF), 0);
}

TEST(RealPictures, AnArmComesAndGoes) {
  const std::unique_ptr<SimSource> with = OpenSim(kSmall + "&arm=on");
  const std::unique_ptr<SimSource> without = OpenSim(kSmall);
  ASSERT_TRUE(with && without);
  int covered = 0, bare = 0;
  for (FrameId k = 0; k < 180; k += 6) {
    cv::Mat difference;
    cv::absdiff(*with->RenderClean(k), *without->RenderClean(k), difference);
    cv::cvtColor(difference, difference, cv::COLOR_BGR2GRAY);
    const double share = cv::countNonZero(difference > 3) / static_cast<double>(difference.total());
    covered += share > 0.03 ? 1 : 0;
    bare += share == 0.0 ? 1 : 0;
    EXPECT_LT(share, 0.3);
  }
  EXPECT_GE(covered, 5);
  EXPECT_GE(bare, 10);
}

TEST(RealPictures, ATurnAtTheStartEndsBeforeTheBoard) {
  const Wearer turn(SimMotion::kWalk, 1, SimStart::kTurn), rest(SimMotion::kWalk, 1);
  EXPECT_NEAR(RotationAngle(turn.WorldFromShoulder(0), rest.WorldFromShoulder(0)), 1.22, 0.05);
  EXPECT_LT(RotationAngle(turn.WorldFromShoulder(1.6), rest.WorldFromShoulder(1.6)), 1e-6);
}

}  // namespace
}  // namespace saccade::real_pictures_test
