#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <set>

#include "server/markers/corner_fit.hpp"
#include "server/markers/grid_search.hpp"
#include "server/markers/marker_detector.hpp"
#include "tests/unit/server/markers/rendered_tags.hpp"

namespace saccade::markers_test {
namespace {

using ::testing::HasSubstr;

CameraModel Camera() {
  CameraIntrinsics lens;
  lens.model = LensModel::kBrownConrady;
  lens.width = 752;
  lens.height = 480;
  lens.fx = lens.fy = 460;
  lens.cx = 368;
  lens.cy = 246;
  lens.distortion = {-0.28, 0.07, 0.0002, 0.0001, 0};
  return CameraModel(lens);
}

TagGrid Grid() {
  TagGrid grid;
  grid.columns = grid.rows = 6;
  grid.side_m = 0.088;
  grid.spacing = 0.3;
  return grid;
}

TagFamily Family() { return *TagFamily::Make("apriltag36h11", 2); }

double WorstCorner(const MarkerSighting& sighting, const TagGrid& grid, const CameraModel& camera,
                   const Rigid3& camera_from_grid) {
  double worst = 0;
  const auto corners = grid.Corners(sighting.id);
  for (int k = 0; k < 4; ++k) {
    const auto pixel = camera.Project(camera_from_grid * corners[k]);
    worst = pixel ? std::max(worst, (*pixel - sighting.corners[k]).norm()) : 1e9;
  }
  return worst;
}

struct Pose {
  double distance_m, yaw, pitch, roll;
};

class SheetOfTags : public ::testing::TestWithParam<Pose> {
 protected:
  Rigid3 pose() const {
    return FacingSheet(Grid(), GetParam().distance_m, GetParam().yaw, GetParam().pitch,
                       GetParam().roll);
  }
  cv::Mat picture() const { return RenderedSheet(Grid(), Family()).Seen(Camera(), pose(), 3, 7); }
};

TEST_P(SheetOfTags, IsReadRightAndFoundWhole) {
  const cv::Mat grey = picture(), untouched = grey.clone();
  std::vector<MarkerSighting> read;
  for (const char* name : {"apriltag", "aruco"}) {
    const auto detector = MakeMarkerDetector(name, {{"apriltag36h11"}, 2});
    ASSERT_TRUE(detector.ok()) << detector.status();
    for (const MarkerSighting& sighting : (*detector)->Detect(grey)) {
      // Whoever reads it: the corners are the tag's own, in one order.
      EXPECT_TRUE(Grid().Holds(sighting.id)) << name << " " << sighting.id;
      EXPECT_LT(WorstCorner(sighting, Grid(), Camera(), pose()), 6.0) << name << sighting.id;
      read.push_back(sighting);
    }
  }
  const auto view = SearchGrid(grey, Camera(), Grid(), Family(), read);
  ASSERT_TRUE(view.has_value()) << read.size() << " tags read";
  EXPECT_GE(view->sightings.size(), 35u);  // at 46 degrees the narrowest is not always read
  double squares = 0, by_variance = 0;
  for (const MarkerSighting& sighting : view->sightings) {
    const double worst = WorstCorner(sighting, Grid(), Camera(), pose());
    EXPECT_LT(worst, 0.5) << sighting.id;
    squares += worst * worst;
    by_variance += *std::max_element(sighting.variance_px2.begin(), sighting.variance_px2.end());
  }
  EXPECT_LT(std::sqrt(squares / 36), 0.2);
  // The variances claim what the worst of four corners is, within a factor of three and a half of
  // sigma.
  EXPECT_LT(by_variance, 9 * squares);
  EXPECT_GT(by_variance, squares / 12);
  EXPECT_LT(RotationAngle(view->camera_from_grid, pose()), 2e-3);
  EXPECT_EQ(cv::norm(grey, untouched, cv::NORM_INF), 0) << "a detector has written to it";
}

INSTANTIATE_TEST_SUITE_P(Poses, SheetOfTags,
                         ::testing::Values(Pose{0.75, 0.1, 0.1, 0}, Pose{0.9, 0.8, 0.0, 0.2},
                                           Pose{0.9, -0.2, 0.9, 3.0}, Pose{1.6, 0.3, -0.3, 1.6}));

TEST(GridSearch, GrowsFromTwoTagsAndLeavesOutAWrongReading) {
  const Rigid3 pose = FacingSheet(Grid(), 0.9, 0.4, 0.2, 0.1);
  const cv::Mat grey = RenderedSheet(Grid(), Family()).Seen(Camera(), pose, 3, 3);
  std::vector<MarkerSighting> read;
  for (const int id : {14, 15, 20}) {
    MarkerSighting sighting;
    sighting.family = "apriltag36h11";
    sighting.id = id;
    const auto corners = Grid().Corners(id);
    for (int k = 0; k < 4; ++k) {  // two pixels off, as a contour is
      sighting.corners[k] = *Camera().Project(pose * corners[k]) + Eigen::Vector2d(1.4, -1.4);
    }
    read.push_back(sighting);
  }
  EXPECT_EQ(SearchGrid(grey, Camera(), Grid(), Family(), read)->sightings.size(), 36u);
  read[2].id = 33;  // read wrongly
  const auto view = SearchGrid(grey, Camera(), Grid(), Family(), read);
  ASSERT_TRUE(view.has_value());
  EXPECT_EQ(view->sightings.size(), 36u);
  for (const MarkerSighting& sighting : view->sightings) {
    EXPECT_LT(WorstCorner(sighting, Grid(), Camera(), pose), 0.5) << sighting.id;
  }
  read.resize(1);
  EXPECT_FALSE(SearchGrid(grey, Camera(), Grid(), Family(), read).has_value());
}

TEST(GridSearch, FindsNoTagWhoseCodeIsAnothers) {
  // A sheet that is the same but for its codes: in its place, nothing of the one looked for.
  TagGrid wide = Grid();
  wide.columns = 12;
  const Rigid3 pose = FacingSheet(Grid(), 0.9, 0, 0.2, 0);
  const cv::Mat grey = RenderedSheet(wide, Family()).Seen(Camera(), pose, 3, 3);
  std::vector<MarkerSighting> read;
  for (const int id : {0, 1, 2}) {
    MarkerSighting sighting;
    sighting.family = "apriltag36h11";
    sighting.id = id;
    const auto corners = Grid().Corners(id);
    for (int k = 0; k < 4; ++k) sighting.corners[k] = *Camera().Project(pose * corners[k]);
    read.push_back(sighting);
  }
  const auto view = SearchGrid(grey, Camera(), Grid(), Family(), read);
  ASSERT_TRUE(view.has_value());
  for (const MarkerSighting& sighting : view->sightings) EXPECT_LT(sighting.id, 6);
}

TEST(MarkerDetector, FindsNothingInNoiseNorInNothing) {
  cv::Mat noise(240, 320, CV_8UC1);
  cv::RNG random(5);
  for (const char* name : {"apriltag", "aruco"}) {
    const auto detector = MakeMarkerDetector(name, {});
    ASSERT_TRUE(detector.ok());
    EXPECT_TRUE((*detector)->Detect(cv::Mat()).empty());
    EXPECT_TRUE((*detector)->Detect(cv::Mat::zeros(40, 40, CV_8UC3)).empty());
    for (int k = 0; k < 8; ++k) {
      random.fill(noise, cv::RNG::UNIFORM, 0, 256);
      cv::GaussianBlur(noise, noise, {}, 0.5 * k + 0.1);
      cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
      EXPECT_TRUE((*detector)->Detect(noise).empty()) << name << " " << k;
    }
  }
}

TEST(MarkerDetector, WhatThereIsNotIsRefusedByName) {
  EXPECT_THAT(std::string(MakeMarkerDetector("qr", {}).status().message()),
              HasSubstr("apriltag, aruco, koller"));
  EXPECT_THAT(std::string(MakeMarkerDetector("apriltag", {{"aruco_4x4_50"}, 1}).status().message()),
              HasSubstr("apriltag36h11"));
  EXPECT_THAT(std::string(MakeMarkerDetector("aruco", {{}, 9}).status().message()),
              HasSubstr("border-bits: 9"));
}

TEST(TagFamily, CorrectsOnlyWhatChanceCannotMake) {
  EXPECT_EQ(TagFamily::Make("apriltag36h11", 1)->MostCorrected(), 2);
  EXPECT_EQ(TagFamily::Make("apriltag25h9", 1)->MostCorrected(), 1);
  EXPECT_EQ(TagFamily::Make("apriltag16h5", 1)->MostCorrected(), 0);
  EXPECT_EQ(TagFamily::Make("apriltag36h11", 2)->cells(), 10);
}

TEST(TagGrid, IsParsedOrRefusedWithAnExample) {
  const auto grid = ParseTagGrid("6x5:0.088:0.3");
  ASSERT_TRUE(grid.ok()) << grid.status();
  EXPECT_EQ(grid->columns, 6);
  EXPECT_EQ(grid->rows, 5);
  EXPECT_NEAR(grid->Corners(7)[2].x(), 0.088 * 2.3, 1e-12);
  EXPECT_NEAR(grid->Corners(7)[2].y(), 0.088 * 2.3, 1e-12);
  for (const char* bad : {"", "6x6", "6x6:0.088", "0x6:0.088:0.3", "6x6:88:0.3", "6x6:0.088:-1",
                          "6x6:nan:0.3", "99x99:0.1:0.3"}) {
    const auto refused = ParseTagGrid(bad);
    ASSERT_FALSE(refused.ok()) << bad;
    EXPECT_THAT(std::string(refused.status().message()), HasSubstr("6x6:0.088:0.3"));
  }
}

TEST(CornerFit, IsRightToATenthAndKnowsASaddle) {
  // Two squares that meet in a corner, and one alone, at places between pixels.
  for (const double shift : {0.0, 0.2, 0.5, 0.8}) {
    for (const bool two : {true, false}) {
      cv::Mat large(64 * 16, 64 * 16, CV_8UC1, cv::Scalar(220));
      const int at = static_cast<int>((32 + shift + 0.5) * 16);
      large(cv::Rect(0, 0, at, at)).setTo(30);
      if (two) large(cv::Rect(at, at, large.cols - at, large.rows - at)).setTo(30);
      cv::Mat grey;
      cv::resize(large, grey, {64, 64}, 0, 0, cv::INTER_AREA);
      cv::GaussianBlur(grey, grey, {}, 0.7);  // as a lens does
      const auto fit = FitCorner(grey, {31.3 + shift, 32.6 + shift}, 4);
      ASSERT_TRUE(fit.has_value());
      // A lone corner is rounded by the smoothing, and so drawn inwards.
      EXPECT_NEAR(fit->pixel.x(), 32 + shift, two ? 0.1 : 0.6);
      EXPECT_NEAR(fit->pixel.y(), 32 + shift, two ? 0.1 : 0.6);
      EXPECT_EQ(IsSaddle(grey, fit->pixel, 4), two);
    }
  }
  EXPECT_FALSE(FitCorner(cv::Mat::zeros(64, 64, CV_8UC1), {32, 32}, 4).has_value());
  EXPECT_FALSE(FitCorner(cv::Mat::zeros(64, 64, CV_8UC1), {2, 2}, 4).has_value());
}

}  // namespace
}  // namespace saccade::markers_test
