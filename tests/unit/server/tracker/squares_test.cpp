// Where a square is, by one picture and by many.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <random>

#include "server/tracker/landmark_options.hpp"
#include "server/tracker/marker_fit.hpp"
#include "server/tracker/square_doubts.hpp"

namespace saccade::squares_test {
namespace {

using ::testing::HasSubstr;

constexpr double kSide_m = 0.08;

CameraModel Camera() {
  CameraIntrinsics lens;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = 560;
  lens.cx = 319.5;
  lens.cy = 239.5;
  return CameraModel(lens);
}

/// A square one metre and a half ahead, ten degrees from frontal.
Rigid3 Square() {
  return {
      ExpQuaternion(Eigen::Vector3d(0.0, 0.17, 0.0)) * ExpQuaternion(Eigen::Vector3d(M_PI, 0, 0)),
      {0.05, -0.04, 1.5}};
}

MarkerView View(const Rigid3& world_from_camera, const Rigid3& square, double side_m,
                std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, 0.2);
  MarkerView view;
  view.world_from_camera = world_from_camera;
  view.sighting.family = "apriltag36h11";
  const auto corners = SquareCorners(view.sighting.family, side_m);
  for (int k = 0; k < 4; ++k) {
    view.sighting.corners[k] =
        *Camera().Project(world_from_camera.Inverse() * (square * corners[k])) +
        Eigen::Vector2d(noise(random), noise(random));
  }
  return view;
}

std::vector<MarkerView> Views(double way_m, int count, double unit, unsigned seed) {
  std::mt19937_64 random(seed);
  Rigid3 square = Square();
  square.translation *= unit;
  std::vector<MarkerView> views;
  for (int k = 0; k < count; ++k) {
    const double along = way_m * (static_cast<double>(k) / (count - 1) - 0.5);
    views.push_back(View({ExpQuaternion(Eigen::Vector3d(0, -0.6 * along, 0)),
                          unit * Eigen::Vector3d(along, 0.3 * along, 0.1 * along)},
                         square, unit * kSide_m, random));
  }
  return views;
}

TEST(PoseOfSquare, IsWrongNowAndThenAndKnowsIt) {
  std::mt19937_64 random(3);
  int flipped = 0, flipped_and_sure = 0;
  for (int k = 0; k < 200; ++k) {
    const MarkerView view = View(Rigid3(), Square(), kSide_m, random);
    const auto pose = PoseOfSquare(Camera(), view.sighting, kSide_m);
    ASSERT_TRUE(pose);
    const bool wrong = RotationAngle(pose->square_from_camera.Inverse(), Square()) > 0.26;
    flipped += wrong ? 1 : 0;
    flipped_and_sure += wrong && pose->sure() ? 1 : 0;
  }
  EXPECT_GT(flipped, 5);
  EXPECT_LT(flipped_and_sure, flipped);
}

TEST(FitMarker, WaitsForParallaxAndIsNeverMirrored) {
  MarkerFitOptions options;
  int placed_at_rest = 0, placed = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto still = FitMarker(Camera(), Views(0.001, 12, 1.0, seed), kSide_m, options);
    placed_at_rest += still ? 1 : 0;
    const auto moved = FitMarker(Camera(), Views(1.2, 12, 1.0, seed), kSide_m, options);
    if (!moved) continue;
    ++placed;
    EXPECT_LT(RotationAngle(moved->world_from_marker, Square()), 0.1);
    EXPECT_LT((moved->world_from_marker.translation - Square().translation).norm(), 0.03);
  }
  EXPECT_EQ(placed, 20);
  EXPECT_LT(placed_at_rest, 3);
}

TEST(FitMarker, TellsWhatAMetreIs) {
  MarkerFitOptions options;
  options.metric = false;
  const auto fit = FitMarker(Camera(), Views(1.2, 12, 0.37, 5), kSide_m, options);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->metre, 0.37, 0.02);
  EXPECT_LT(std::abs(std::log(fit->metre / 0.37)), 4.0 * fit->log_metre_sigma);
  EXPECT_FALSE(FitMarker(Camera(), Views(1.2, 4, 0.37, 5), kSide_m, options));
}

TEST(PoseOfSquares, LeavesOutASquareThatHasMoved) {
  std::mt19937_64 random(1);
  SquareMap map;
  std::vector<MarkerSighting> seen;
  for (int k = 0; k < 4; ++k) {
    Rigid3 pose = Square();
    pose.translation += Eigen::Vector3d(0.25 * k - 0.4, 0.1 * (k % 2), 0);
    map.squares.push_back({"apriltag36h11", k, kSide_m, pose});
    if (k == 2) pose.translation += Eigen::Vector3d(0.1, 0, 0);
    MarkerSighting sighting = View(Rigid3(), pose, kSide_m, random).sighting;
    sighting.id = k;
    seen.push_back(sighting);
  }
  const auto pose = PoseOfSquares(Camera(), seen, map);
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->squares, 3);
  EXPECT_LT(pose->fit.world_from_camera.translation.norm(), 0.1);  // flat, near frontal
  // One square near frontal does not tell.
  EXPECT_FALSE(PoseOfSquares(Camera(), {seen[2]}, SquareMap()));
}

/// Five squares on two walls, seen from several places; square 2 is printed at `factor`.
std::vector<std::string> WordsAbout(double factor, bool twice) {
  std::mt19937_64 random(4);
  SquareMap map;
  for (int k = 0; k < 5; ++k) {
    Rigid3 pose = Square();
    pose.translation += Eigen::Vector3d(0.22 * k - 0.4, 0.12 * (k % 3) - 0.1, 0.05 * k);
    if (k > 2) pose.rotation = ExpQuaternion(Eigen::Vector3d(0, -0.7, 0)) * pose.rotation;
    map.squares.push_back({"apriltag36h11", k, kSide_m, pose});
  }
  SquareDoubts doubts;
  std::vector<std::string> words;
  for (int picture = 0; picture < 10; ++picture) {
    const Rigid3 camera(ExpQuaternion(Eigen::Vector3d(0.01 * picture, 0.02 * picture, 0)),
                        {0.03 * picture - 0.1, 0.05, 0.02 * picture});
    std::vector<MarkerSighting> seen;
    for (const KnownSquare& square : map.squares) {
      const double side = square.id == 2 ? factor * kSide_m : kSide_m;
      seen.push_back(View(camera, square.world_from_square, side, random).sighting);
      seen.back().id = square.id;
    }
    if (twice) {
      MarkerSighting twin = seen[1];
      for (Eigen::Vector2d& corner : twin.corners) corner += Eigen::Vector2d(150, 40);
      seen.push_back(twin);
      EXPECT_TRUE(PoseOfSquares(Camera(), seen, map));  // by the others
      EXPECT_FALSE(PoseOfSquares(Camera(), {seen[1], twin}, map));
    }
    doubts.Add(Camera(), seen, map);
    for (std::string& one : doubts.Take()) words.push_back(std::move(one));
  }
  return words;
}

TEST(SquareDoubts, ASquareOfAnotherSizeThanSaidIsNamedWithItsSize) {
  EXPECT_THAT(WordsAbout(1.0, false), ::testing::IsEmpty());
  for (const double factor : {1.25, 0.8}) {
    const std::vector<std::string> words = WordsAbout(factor, false);
    ASSERT_EQ(words.size(), 1u);
    EXPECT_THAT(words[0], HasSubstr("apriltag36h11 2 "));
    const std::string before = "by the others it is ";
    ASSERT_THAT(words[0], HasSubstr(before));
    EXPECT_NEAR(std::stod(words[0].substr(words[0].find(before) + before.size())), factor, 0.021);
    EXPECT_THAT(words[0], HasSubstr("instead of 80.0 mm"));
  }
}

TEST(SquareDoubts, OneThatIsThereTwiceIsNotUsedAndNamed) {
  const std::vector<std::string> words = WordsAbout(1.0, true);
  ASSERT_EQ(words.size(), 1u);
  EXPECT_THAT(words[0], HasSubstr("apriltag36h11 1 is in the picture twice"));
}

TEST(SquareDoubts, AMirroredPictureIsNamedOnceAfterSomePictures) {
  SquareDoubts doubts;
  doubts.AddMirrored(2);
  doubts.AddMirrored(0);  // it was noise
  doubts.AddMirrored(2);
  doubts.AddMirrored(2);
  EXPECT_THAT(doubts.Take(), ::testing::IsEmpty());
  doubts.AddMirrored(2);
  EXPECT_THAT(doubts.Take(), ::testing::ElementsAre(HasSubstr("the picture is mirrored: 2")));
  doubts.AddMirrored(2);
  EXPECT_THAT(doubts.Take(), ::testing::IsEmpty());
}

TEST(LandmarkOptions, AreReadAndRefused) {
  LandmarkOptions options;
  EXPECT_FALSE(options.wanted());
  EXPECT_TRUE(options.Set("family", "apriltag25h9").ok());
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("go together"));
  EXPECT_TRUE(options.Set("size_m", "0.05").ok());
  EXPECT_TRUE(options.Validate().ok());
  EXPECT_TRUE(options.wanted());
  EXPECT_THAT(std::string(options.Set("side", "1").message()), HasSubstr("known: mode"));
  EXPECT_FALSE(options.Set("size_m", "big").ok());
  EXPECT_TRUE(options.Set("mode", "koller").ok());
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("landmarks.file"));

  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) /
                                     ("squares-config-" + std::to_string(::getpid()) + ".toml");
  std::ofstream(file) << "[landmarks]\nmode = \"koller\"\nfile = \"squares.toml\"\n";
  LandmarkOptions read;
  ASSERT_TRUE(read.LoadToml(file).ok());
  EXPECT_EQ(read.mode, "koller");
  EXPECT_EQ(read.file, file.parent_path() / "squares.toml");
  std::ofstream(file) << "[landmarks]\nsize = 1\n";
  EXPECT_THAT(std::string(read.LoadToml(file).message()), HasSubstr("size"));
}

}  // namespace
}  // namespace saccade::squares_test
