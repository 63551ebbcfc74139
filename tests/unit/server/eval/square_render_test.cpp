#include "server/eval/markers/square_render.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "server/eval/markers/render_score.hpp"
#include "server/markers/marker_detector.hpp"

namespace saccade::square_render_test {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kSeed = 2024;  // none that the detectors were made on

SquareRender Plain(int id, int from) {
  for (int k = from;; ++k) {
    SquareRender render = RenderSquare(*PatternOf("koller", id), kSeed, k);
    if (render.kind == RenderKind::kPlain && render.side_px > 60) return render;
  }
}

TEST(SquareRender, IsTheSameEachTimeAndAnotherByNumber) {
  const MarkerPattern pattern = *PatternOf("koller", 3);
  const SquareRender first = RenderSquare(pattern, 5, 8), again = RenderSquare(pattern, 5, 8);
  EXPECT_EQ(cv::norm(first.color, again.color, cv::NORM_L1), 0);
  EXPECT_NE(first.corners[0], RenderSquare(pattern, 5, 9).corners[0]);
}

TEST(KollerDetector, FindsItsSquaresAndClaimsWhatItsCornersAre) {
  const auto detector = MakeMarkerDetector("koller", {});
  RenderScore score;
  for (int k = 0; k < 150; ++k) {
    const int id = k % 16;
    const SquareRender render = RenderSquare(*PatternOf("koller", id), kSeed, k);
    score.Add(render, "koller", id, (*detector)->Detect(render.color), 0);
  }
  EXPECT_EQ(score.wrong(), 0);
  EXPECT_GE(score.VisibleFound(), 0.96);  // reflections on a tenth of them; figures: measurements
  // What is covered by something as dark as the square is refused: cells could be, too.
  EXPECT_GE(score.BorderCoveredFound(), 0.25);
  EXPECT_GT(score.Nees(), 1.3);
  EXPECT_LT(score.Nees(), 2.9);
}

TEST(KollerDetector, AnIdThatIsThereTwiceIsNotGivenAtAll) {
  const SquareRender one = Plain(6, 0), other = Plain(6, 100), third = Plain(9, 200);
  cv::Mat both;
  cv::hconcat(std::vector<cv::Mat>{one.color, other.color, third.color}, both);
  const auto detector = MakeMarkerDetector("koller", {});
  const auto seen = (*detector)->Detect(both);
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_EQ(seen[0].id, 9);
  int repeated = 0;
  for (const MarkerDrop& drop : (*detector)->dropped()) {
    if (drop.id != 6) continue;
    EXPECT_THAT(drop.reason, HasSubstr("give each square an id of its own"));
    ++repeated;
  }
  EXPECT_EQ(repeated, 2);
}

TEST(KollerDetector, AMirroredPictureIsRefusedWhereTheIdsAreKnown) {
  cv::Mat both, mirrored;
  cv::hconcat(Plain(2, 0).color, Plain(4, 100).color, both);
  cv::flip(both, mirrored, 1);
  const auto detector = MakeMarkerDetector("koller", {{}, 1, {0, 1, 2, 3, 4, 5, 6, 7}});
  EXPECT_EQ((*detector)->Detect(both).size(), 2u);
  EXPECT_TRUE((*detector)->Detect(mirrored).empty());  // as 1 and 8
  int told = 0;
  for (const MarkerDrop& drop : (*detector)->dropped()) {
    told += drop.id >= 0 && drop.reason.find("mirrored") != std::string::npos;
  }
  EXPECT_EQ(told, 2);
}

TEST(KollerDetector, FindsNothingInGreyInNoiseNorInNothing) {
  const auto detector = MakeMarkerDetector("koller", {});
  EXPECT_TRUE((*detector)->Detect(cv::Mat()).empty());
  cv::Mat grey;
  cv::cvtColor(Plain(3, 0).color, grey, cv::COLOR_BGR2GRAY);
  EXPECT_TRUE((*detector)->Detect(grey).empty());
  cv::cvtColor(grey, grey, cv::COLOR_GRAY2BGR);
  EXPECT_TRUE((*detector)->Detect(grey).empty());
  cv::RNG random(4);
  for (int k = 0; k < 6; ++k) {
    cv::Mat noise(240, 320, CV_8UC3);
    random.fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(noise, noise, {}, 0.8 * k + 0.1);
    cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
    EXPECT_TRUE((*detector)->Detect(noise).empty()) << k;
  }
}

TEST(Mirrored, ATagsPictureTellsThatItIs) {
  const auto detector = MakeMarkerDetector("apriltag", {{"apriltag36h11"}});
  cv::Mat grey, mirrored;
  for (int k = 0;; ++k) {
    const SquareRender render = RenderSquare(*PatternOf("apriltag36h11", 7), kSeed, k);
    if (render.kind != RenderKind::kPlain || render.side_px < 90) continue;
    cv::cvtColor(render.color, grey, cv::COLOR_BGR2GRAY);
    break;
  }
  cv::flip(grey, mirrored, 1);
  EXPECT_TRUE((*detector)->Detect(mirrored).empty());
  EXPECT_EQ(CountIfMirrored(**detector, mirrored), 1u);
  EXPECT_EQ(CountIfMirrored(**detector, cv::Mat()), 0u);
}

}  // namespace
}  // namespace saccade::square_render_test
