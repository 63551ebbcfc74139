// Squares that are known about: their map, and the search for their sides.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgproc.hpp>

#include "server/markers/corner_look.hpp"
#include "server/markers/square_map.hpp"
#include "server/markers/square_search.hpp"
#include "server/markers/square_watch.hpp"
#include "tests/unit/server/markers/rendered_tags.hpp"

namespace saccade::squares_test {
namespace {

using ::testing::HasSubstr;

CameraModel Camera() {
  CameraIntrinsics lens;
  lens.model = LensModel::kBrownConrady;
  lens.width = 400;
  lens.height = 300;
  lens.fx = lens.fy = 360;
  lens.cx = 199;
  lens.cy = 151;
  lens.distortion = {-0.2, 0.05, 0.0002, 0.0001, 0};
  return CameraModel(lens);
}

TagGrid OneTag() {
  TagGrid grid;
  grid.columns = grid.rows = 1;
  grid.side_m = 0.16;
  grid.spacing = 0.3;
  return grid;
}

struct Seen {
  cv::Mat picture;
  std::array<Eigen::Vector2d, 4> corners;
};

Seen Render(double distance_m, double yaw, double roll, unsigned seed) {
  const CameraModel camera = Camera();
  const Rigid3 pose = FacingSheet(OneTag(), distance_m, yaw, 0.3, roll);
  Seen seen;
  seen.picture =
      RenderedSheet(OneTag(), *TagFamily::Make("apriltag36h11", 1)).Seen(camera, pose, 3, seed);
  const auto points = OneTag().Corners(0);
  for (int k = 0; k < 4; ++k) seen.corners[k] = *camera.Project(pose * points[k]);
  return seen;
}

SquareGuess Off(const Seen& seen, const Eigen::Vector2d& shift, double sigma_px) {
  SquareGuess guess;
  for (int k = 0; k < 4; ++k) {
    guess.corners[k] = seen.corners[k] + shift;
    guess.covariances[k] = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  }
  return guess;
}

TEST(SquareSearch, FindsCornersToAFractionOfAPixelAndKnowsHowWell) {
  double squares = 0, worst = 0;
  int count = 0;
  for (int k = 0; k < 8; ++k) {
    const Seen seen = Render(0.6 + 0.12 * k, 0.12 * (k - 4), 0.27 * k, 3 + k);
    const SquareSearch search =
        SearchSquareTwice(seen.picture, Camera(), Off(seen, {2.0, -1.5}, 1.5));
    ASSERT_EQ(search.found(), 4) << "picture " << k;
    for (int c = 0; c < 4; ++c) {
      const Eigen::Vector2d off = search.corners[c]->pixel - seen.corners[c];
      squares += off.dot(search.corners[c]->covariance.inverse() * off);
      worst = std::max(worst, off.norm());
      ++count;
    }
  }
  std::cout << "worst corner " << worst << " px, NEES " << squares / count << "\n";
  EXPECT_LT(worst, 0.3);
  EXPECT_LT(squares / count, 2.6);  // of two; T21's upper end
  EXPECT_GT(squares / count, 0.5);
}

TEST(SquareSearch, FindsNothingWhereTheSquareIsCovered) {
  Seen seen = Render(0.8, 0.2, 0.1, 9);
  seen.picture.setTo(110);
  EXPECT_EQ(SearchSquare(seen.picture, Camera(), Off(seen, {0, 0}, 2)).lines, 0);
}

TEST(SquareSearch, KeepsTheCornersThatAHandLeavesFree) {
  Seen seen = Render(0.7, 0.0, 0.0, 9);
  // Over the corner 0 and the ends of its two sides.
  cv::circle(seen.picture,
             {static_cast<int>(seen.corners[0].x()), static_cast<int>(seen.corners[0].y())}, 44,
             cv::Scalar(120), cv::FILLED);
  const SquareSearch search = SearchSquare(seen.picture, Camera(), Off(seen, {1, 1}, 1));
  ASSERT_TRUE(search.corners[2].has_value());
  EXPECT_LT((search.corners[2]->pixel - seen.corners[2]).norm(), 0.3);
  if (search.corners[0]) {
    EXPECT_LT((search.corners[0]->pixel - seen.corners[0]).norm(), 1.0);
  }
}

/// Corners that the search finds and that look like corners.
std::array<bool, 4> InView(const cv::Mat& picture, const Seen& seen) {
  const SquareGuess guess = Off(seen, {1, 1}, 1);
  const SquareSearch search = SearchSquareTwice(picture, Camera(), guess);
  return LookAtCorners(picture, guess, search, BorderShare("apriltag36h11")).seen;
}

TEST(CornerLook, TellsASquaresCornerFromWhatIsHeldBeforeIt) {
  int seen_free = 0, seen_behind = 0, behind = 0;
  for (int k = 0; k < 5; ++k) {
    const Seen seen = Render(0.55 + 0.14 * k, 0.16 * (k - 2), 0.4 * k, 20 + k);
    for (const bool one : InView(seen.picture, seen)) seen_free += one ? 1 : 0;
    // A checked sleeve over two of them, as bright and as dark as the square.
    cv::Mat picture = seen.picture.clone();
    const Eigen::Vector2d a = seen.corners[0];
    const Eigen::Vector2d across = 0.45 * (seen.corners[3] - seen.corners[0]);
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        const Eigen::Vector2d off = Eigen::Vector2d(x, y) - a;
        if (off.dot(across) > across.squaredNorm()) continue;
        const bool bright = (x / 9 + y / 7 + k) % 2 == 0;
        picture.at<std::uint8_t>(y, x) = bright ? 215 : 35;
      }
    }
    cv::GaussianBlur(picture, picture, {}, 0.7);
    const std::array<bool, 4> left = InView(picture, seen);
    behind += 2;
    seen_behind += (left[0] ? 1 : 0) + (left[1] ? 1 : 0);
  }
  EXPECT_EQ(seen_free, 20);
  EXPECT_LE(seen_behind, 1) << "of " << behind;
}

TEST(SquareWatch, AMirroredPictureIsFoundOut) {
  MarkerOptions options;
  options.families = {"apriltag36h11"};
  SquareWatch watch(*MakeMarkerDetector("apriltag", options));
  cv::Mat mirrored;
  cv::flip(Render(0.7, 0.1, 0.1, 5).picture, mirrored, 1);
  std::size_t found = 0;
  for (int k = 0; k < 8; ++k) {
    watch.Look(mirrored, k);
    const auto seen = watch.Take(true);
    ASSERT_TRUE(seen);
    EXPECT_TRUE(seen->sightings.empty());
    found += seen->mirrored.value_or(0);
  }
  EXPECT_EQ(found, 2u);  // every fourth picture is looked at so
}

TEST(SquareSearch, OfPicturesEdgeAndTinySquaresHasNothingToSay) {
  const Seen seen = Render(0.8, 0, 0, 1);
  SquareGuess guess = Off(seen, {-250, 0}, 1);
  EXPECT_EQ(SearchSquare(seen.picture, Camera(), guess).found(), 0);
  for (int k = 0; k < 4; ++k) guess.corners[k] = {200.0 + k % 2, 150.0 + k / 2};
  EXPECT_EQ(SearchSquare(seen.picture, Camera(), guess).found(), 0);
}

TEST(SquareWatch, SeesOnItsOwnThreadWhatTheDetectorSees) {
  MarkerOptions options;
  options.families = {"apriltag36h11"};
  SquareWatch watch(*MakeMarkerDetector("apriltag", options));
  EXPECT_FALSE(watch.Take(true));
  watch.Look(Render(0.7, 0.1, 0.1, 5).picture, 42);
  EXPECT_TRUE(watch.looking());
  const auto seen = watch.Take(true);
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->time_ns, 42);
  ASSERT_EQ(seen->sightings.size(), 1u);
  EXPECT_EQ(seen->sightings[0].id, 0);
}

class SquareMapFile : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& text) {
    const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) /
                                       ("squares-" + std::to_string(::getpid()) + ".toml");
    std::ofstream(file) << text;
    return file;
  }
  static KnownSquare Square(int id) {
    return {"apriltag36h11", id, 0.16, {Eigen::Quaterniond(0, 1, 0, 0), {1.0, 2.0, 3.0}}};
  }
};

TEST_F(SquareMapFile, ReadsWhatItWrites) {
  const SquareMap map{{Square(3), Square(7)}};
  const auto read = LoadSquareMap(Write(map.ToToml()));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->squares.size(), 2u);
  const KnownSquare* square = read->Find("apriltag36h11", 7);
  ASSERT_NE(square, nullptr);
  EXPECT_EQ(read->Find("apriltag36h11", 4), nullptr);
  EXPECT_EQ(read->Find("aruco_4x4_50", 7), nullptr);
  // Half a turn about x: the tag's bottom left corner is above the middle, in a world whose y is
  // down.
  EXPECT_LT((square->CornersInWorld()[0] - Eigen::Vector3d(0.92, 2.08, 3.0)).norm(), 1e-6);
}

TEST_F(SquareMapFile, RefusesWhatCannotBeWithItsFieldAndRemedy) {
  const auto message = [&](const std::string& text) {
    return std::string(LoadSquareMap(Write(text)).status().message());
  };
  EXPECT_THAT(message((SquareMap{{Square(3), Square(3)}}).ToToml()), HasSubstr("3 is there twice"));
  KnownSquare square = Square(3);
  square.side_m = -0.1;
  EXPECT_THAT(message(SquareMap{{square}}.ToToml()), HasSubstr("side_m"));
  square = Square(3);
  square.world_from_square.rotation.coeffs() *= 0.5;
  EXPECT_THAT(message(SquareMap{{square}}.ToToml()), HasSubstr("rotation_xyzw"));
  EXPECT_THAT(message("[[square]]\nfamily = \"a\"\nid = 1\nside = 2\n"),
              HasSubstr("unknown key side"));
  EXPECT_THAT(message("[[square]]\nfamily = \"a\"\nid = 1\nside_m = 0.1\nmiddle_m = [1, 2]\n"
                      "rotation_xyzw = [0, 0, 0, 1]\n"),
              HasSubstr("middle_m: give 3 numbers"));
  EXPECT_EQ(LoadSquareMap("/nowhere/squares.toml").status().code(), absl::StatusCode::kNotFound);
}

TEST(SquareCorners, AreInTheMakersOrder) {
  EXPECT_EQ(SquareCorners("apriltag36h11", 2.0)[0], Eigen::Vector3d(-1, -1, 0));
  EXPECT_EQ(SquareCorners("aruco_4x4_50", 2.0)[0], Eigen::Vector3d(-1, 1, 0));
}

}  // namespace
}  // namespace saccade::squares_test
