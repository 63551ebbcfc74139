#include "server/features/search.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "server/features/corner_detector.hpp"
#include "server/features/patch.hpp"
#include "tests/unit/server/features/textured_plane.hpp"

namespace saccade::search_test {
namespace {

std::shared_ptr<const CameraModel> Pinhole(int width = 320, int height = 240) {
  CameraIntrinsics k;
  k.width = width;
  k.height = height;
  k.fx = k.fy = 300;
  k.cx = width / 2.0 - 0.5;
  k.cy = height / 2.0 - 0.5;
  return std::make_shared<CameraModel>(k);
}

std::shared_ptr<const CameraModel> WideLens() {
  CameraIntrinsics k;  // of the desk recording: about 90 degrees
  k.model = LensModel::kRadial1;
  k.width = 320;
  k.height = 240;
  k.fx = k.fy = 195;
  k.cx = 162;
  k.cy = 125;
  k.distortion = {9.0e-6};
  return std::make_shared<CameraModel>(k);
}

Rigid3 Pose(const Eigen::Vector3d& rotation_vector, const Eigen::Vector3d& position) {
  return {ExpQuaternion(rotation_vector), position};
}

/// Two views of the plane, the features of the first and where they are in the second.
struct TwoViews {
  std::shared_ptr<const CameraModel> camera;
  Rigid3 world_from_birth, world_from_current;
  cv::Mat birth, current;
  ImagePyramid pyramid;
  struct Feature {
    PatchTemplate patch;
    Eigen::Vector3d point;
    Eigen::Vector2d truth;
    double inverse_depth;
  };
  std::vector<Feature> features;

  TwoViews(std::shared_ptr<const CameraModel> lens, const Rigid3& from, const Rigid3& to,
           double noise, int count)
      : camera(std::move(lens)), world_from_birth(from), world_from_current(to) {
    const TexturedPlane plane(5, 4.0 / camera->intrinsics().fx);
    birth = plane.Render(*camera, from, noise, 1);
    current = plane.Render(*camera, to, noise, 2);
    EXPECT_TRUE(pyramid.Build(current).ok());
    ImagePyramid first;
    EXPECT_TRUE(first.Build(birth).ok());
    CornerDetector detector({.min_score = 2000, .border_px = 24, .cell_px = 14});
    std::vector<Corner> corners;
    detector.DetectAll(first, {}, 1000, corners);
    for (const Corner& corner : corners) {
      const Eigen::Vector3d point = TexturedPlane::PointAt(*camera, from, corner.pixel);
      const auto truth = camera->Project(to.Inverse() * point);
      if (!truth || !camera->InImage(*truth, 16)) continue;
      auto patch = CutPatch(birth, corner.pixel, camera);
      EXPECT_TRUE(patch.ok());
      const double range = (from.Inverse() * point).norm();
      features.push_back({*patch, point, *truth, 1.0 / range});
      if (static_cast<int>(features.size()) == count) break;
    }
  }

  Rigid3 current_from_birth() const { return world_from_current.Inverse() * world_from_birth; }

  WarpStatus Warp(const Feature& f, const Eigen::Vector2d& predicted, WarpedPatch& out) const {
    const Eigen::Vector3d normal =
        world_from_birth.rotation.conjugate() * -Eigen::Vector3d::UnitZ();
    return WarpPatch(f.patch, current_from_birth(), f.patch.birth_bearing, f.inverse_depth, normal,
                     *camera, predicted, {}, out);
  }
};

struct Rates {
  double warped = 0, unwarped = 0, rms_px = 0;
};

/// Fraction of features found within a pixel of the truth, predicted 2 px (one sigma) beside it.
Rates MatchRates(const TwoViews& views) {
  PatchSearcher searcher({});
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 2.0);
  Rates rates;
  double squared = 0;
  int hits = 0;
  for (const auto& feature : views.features) {
    const Eigen::Vector2d predicted =
        feature.truth + Eigen::Vector2d(normal(random), normal(random)).cwiseMax(-4).cwiseMin(4);
    const Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() * 5.0;
    WarpedPatch patch;
    if (views.Warp(feature, predicted, patch) == WarpStatus::kOk) {
      const SearchResult result = searcher.Find(views.pyramid, patch, predicted, covariance);
      const double error = (result.pixel - feature.truth).norm();
      if (result.found() && error < 1.0) {
        ++hits;
        squared += error * error;
      }
    }
    if (CopyPatch(feature.patch, {}, patch) == WarpStatus::kOk) {
      const SearchResult result = searcher.Find(views.pyramid, patch, predicted, covariance);
      if (result.found() && (result.pixel - feature.truth).norm() < 1.0) rates.unwarped += 1;
    }
  }
  const double count = static_cast<double>(views.features.size());
  rates.warped = hits / count;
  rates.unwarped /= count;
  rates.rms_px = std::sqrt(squared / std::max(1, hits));
  return rates;
}

TEST(PatchSearch, T11MatchesPlanarPatchAfterRollAndScale) {
  const TwoViews views(Pinhole(), Pose({0, 0, 0}, {0, 0, -1.0}),
                       Pose({0, 0, M_PI / 6}, {0, 0, -1.0 / 1.5}), 2.0, 200);
  ASSERT_GE(views.features.size(), 60U);
  const Rates rates = MatchRates(views);
  std::printf("T11 pinhole: %zu patches, warped %.1f %%, unwarped %.1f %%, rms %.3f px\n",
              views.features.size(), 100 * rates.warped, 100 * rates.unwarped, rates.rms_px);
  RecordProperty("warped_percent", std::to_string(100 * rates.warped));
  RecordProperty("unwarped_percent", std::to_string(100 * rates.unwarped));
  EXPECT_GE(rates.warped, 0.95);
  EXPECT_LT(rates.unwarped, rates.warped);
}

TEST(PatchSearch, T11HoldsForWideLensAwayFromTheCentre) {
  const TwoViews views(WideLens(), Pose({0, 0, 0}, {0, 0, -1.0}),
                       Pose({0.1, -0.35, M_PI / 6}, {0.25, 0.05, -0.75}), 2.0, 200);
  ASSERT_GE(views.features.size(), 60U);
  const Rates rates = MatchRates(views);
  std::printf("T11 wide lens: %zu patches, warped %.1f %%, unwarped %.1f %%, rms %.3f px\n",
              views.features.size(), 100 * rates.warped, 100 * rates.unwarped, rates.rms_px);
  EXPECT_GE(rates.warped, 0.95);
}

/// The plane from 1 m and, shifted by fractions of a pixel and a little turned, from 0.98 m.
std::vector<TwoViews> ShiftedViews(double noise) {
  std::vector<TwoViews> views;
  for (int k = 0; k < 4; ++k) {
    const double shift = (0.21 * k + 0.06) / 300.0;
    views.emplace_back(Pinhole(), Pose({0, 0, 0}, {0, 0, -1.0}),
                       Pose({0, 0, 0.02}, {shift, 0.7 * shift, -0.98}), noise, 120);
  }
  return views;
}

/// RMS error [px] of one sub-pixel method, per axis.
double SubPixelRms(const std::vector<TwoViews>& shifted, SubPixel method,
                   double* mean_nees = nullptr) {
  double squared = 0, nees = 0;
  int count = 0;
  SearchOptions options;
  options.sub_pixel = method;
  PatchSearcher searcher(options);
  for (const TwoViews& views : shifted) {
    for (const auto& feature : views.features) {
      WarpedPatch patch;
      if (views.Warp(feature, feature.truth, patch) != WarpStatus::kOk) continue;
      const SearchResult result =
          searcher.Find(views.pyramid, patch, feature.truth, Eigen::Matrix2d::Identity());
      if (!result.found()) continue;
      const Eigen::Vector2d error = result.pixel - feature.truth;
      squared += error.squaredNorm() / 2;
      nees += error.dot(result.covariance.inverse() * error);
      ++count;
    }
  }
  EXPECT_GT(count, 240);
  if (mean_nees != nullptr) *mean_nees = nees / count;
  return std::sqrt(squared / count);
}

TEST(PatchSearch, SubPixelMethodsReachTheirAccuracy) {
  double nees = 0;
  const std::vector<TwoViews> clean = ShiftedViews(0.0);
  const double whole = SubPixelRms(clean, SubPixel::kNone);
  const double parabola = SubPixelRms(clean, SubPixel::kParabola);
  const double lucas_kanade = SubPixelRms(clean, SubPixel::kLucasKanade);
  const double noisy = SubPixelRms(ShiftedViews(3.0), SubPixel::kLucasKanade, &nees);
  std::printf(
      "sub-pixel rms per axis: whole %.3f, parabola %.3f, LK %.3f, LK noise 3 %.3f px "
      "(mean NEES %.2f of 2)\n",
      whole, parabola, lucas_kanade, noisy, nees);
  EXPECT_LT(whole, 0.35);
  EXPECT_LT(parabola, 0.12);
  EXPECT_LT(lucas_kanade, 0.02);
  EXPECT_LT(noisy, 0.06);
  EXPECT_LT(nees, 4.0);
  EXPECT_GT(nees, 0.2);
}

class SearchNearFlat : public ::testing::Test {
 protected:
  SearchNearFlat() : plane_(8, 4.0 / 300), camera_(Pinhole()) {
    image_ = plane_.Render(*camera_, Pose({0, 0, 0}, {0, 0, -1.0}));
    EXPECT_TRUE(pyramid_.Build(image_).ok());
  }
  WarpedPatch PatchAt(const Eigen::Vector2d& pixel) {
    WarpedPatch patch;
    EXPECT_EQ(CopyPatch(*CutPatch(image_, pixel, camera_), {}, patch), WarpStatus::kOk);
    return patch;
  }
  TexturedPlane plane_;
  std::shared_ptr<const CameraModel> camera_;
  cv::Mat image_;
  ImagePyramid pyramid_;
};

TEST_F(SearchNearFlat, FindsItselfExactly) {
  PatchSearcher searcher({});
  const SearchResult result = searcher.Find(pyramid_, PatchAt({150, 100}), {153.0, 98.0},
                                            Eigen::Matrix2d::Identity() * 4.0);
  ASSERT_TRUE(result.found());
  EXPECT_NEAR(result.zncc, 1.0, 1e-5);
  EXPECT_NEAR((result.pixel - Eigen::Vector2d(150, 100)).norm(), 0.0, 0.01);
  EXPECT_LT(result.rival_zncc, 0.9);
}

TEST_F(SearchNearFlat, StaysInsideTheEllipse) {
  PatchSearcher searcher({});
  Eigen::Matrix2d thin;  // 45 degrees: long along (1, 1), narrow across
  thin << 8.0, 7.5, 7.5, 8.0;
  const WarpedPatch patch = PatchAt({150, 100});
  // 6 px along the long axis: inside. The same distance across: outside, though inside the box.
  EXPECT_TRUE(searcher.Find(pyramid_, patch, {156, 106}, thin).found());
  const SearchResult across = searcher.Find(pyramid_, patch, {156, 94}, thin);
  EXPECT_FALSE(across.found() && (across.pixel - Eigen::Vector2d(150, 100)).norm() < 1.0);
  const double area = M_PI * 9 * std::sqrt(thin.determinant());
  EXPECT_NEAR(across.evaluated, area, 0.25 * area);
}

TEST_F(SearchNearFlat, ScansEveryPixelOfTheEllipseAndNoOther) {
  SearchOptions options;
  options.coarse_above_pixels = 100000;
  PatchSearcher searcher(options);
  Eigen::Matrix2d covariance;
  covariance << 6.0, 2.0, 2.0, 3.0;
  const Eigen::Vector2d centre(150.3, 99.6);
  int inside = 0;
  for (int y = 60; y < 140; ++y) {
    for (int x = 100; x < 200; ++x) {
      const Eigen::Vector2d n = Eigen::Vector2d(x, y) - centre;
      if (n.dot(covariance.inverse() * n) < 9.0) ++inside;
    }
  }
  EXPECT_EQ(searcher.Find(pyramid_, PatchAt({150, 100}), centre, covariance).evaluated, inside);
}

TEST_F(SearchNearFlat, CoarseSearchAgreesWithFullSearch) {
  PatchSearcher coarse({});
  SearchOptions full_options;
  full_options.coarse_above_pixels = 1000000;
  PatchSearcher full(full_options);
  const Eigen::Matrix2d large = Eigen::Matrix2d::Identity() * 64.0;
  int agree = 0, count = 0, cheaper = 0;
  for (int y = 50; y < 190; y += 20) {
    for (int x = 50; x < 270; x += 20) {
      const Eigen::Vector2d pixel(x + 0.3, y - 0.4);
      const WarpedPatch patch = PatchAt(pixel);
      const Eigen::Vector2d predicted = pixel + Eigen::Vector2d(9.0, -12.0);
      const SearchResult a = coarse.Find(pyramid_, patch, predicted, large);
      const SearchResult b = full.Find(pyramid_, patch, predicted, large);
      ++count;
      agree += a.found() && b.found() && (a.pixel - b.pixel).norm() < 0.05;
      cheaper += a.evaluated * 3 < b.evaluated;
    }
  }
  EXPECT_GE(agree, count * 97 / 100) << "of " << count;
  EXPECT_EQ(cheaper, count);
}

TEST_F(SearchNearFlat, WorksUpToThePictureBorderAndNotBeyond) {
  PatchSearcher searcher({});
  const Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() * 4.0;
  const int w = camera_->width(), h = camera_->height();
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(9, 9), Eigen::Vector2d(w - 10, 9), Eigen::Vector2d(9, h - 10),
        Eigen::Vector2d(w - 10, h - 10)}) {
    const SearchResult result = searcher.Find(pyramid_, PatchAt(pixel), pixel, covariance);
    ASSERT_TRUE(result.found()) << pixel.transpose();
    EXPECT_LT((result.pixel - pixel).norm(), 0.02) << pixel.transpose();
  }
  const WarpedPatch patch = PatchAt({150, 100});
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(-40, 50), Eigen::Vector2d(w + 40, 50),
                                       Eigen::Vector2d(50, -40), Eigen::Vector2d(50, h + 40)}) {
    EXPECT_EQ(searcher.Find(pyramid_, patch, pixel, covariance).status, SearchStatus::kOutside);
  }
}

TEST_F(SearchNearFlat, RefusesBadNumbers) {
  PatchSearcher searcher({});
  const WarpedPatch patch = PatchAt({150, 100});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const Eigen::Matrix2d good = Eigen::Matrix2d::Identity() * 4.0;
  for (const double bad : {nan, inf, -inf, 1e300}) {
    EXPECT_EQ(searcher.Find(pyramid_, patch, {bad, 100}, good).status, SearchStatus::kBadInput);
    Eigen::Matrix2d covariance = good;
    covariance(0, 1) = covariance(1, 0) = bad;
    EXPECT_FALSE(searcher.Find(pyramid_, patch, {150, 100}, covariance).found()) << bad;
  }
  EXPECT_EQ(searcher.Find(pyramid_, patch, {150, 100}, -good).status, SearchStatus::kBadInput);
  EXPECT_EQ(searcher.Find(pyramid_, patch, {150, 100}, 200 * good).status,
            SearchStatus::kTooUncertain);
  EXPECT_EQ(searcher.Find(ImagePyramid(), patch, {150, 100}, good).status, SearchStatus::kBadInput);
  EXPECT_EQ(searcher.Find(pyramid_, WarpedPatch(), {150, 100}, good).status,
            SearchStatus::kBadInput);
}

TEST_F(SearchNearFlat, IgnoresGainAndOffset) {
  cv::Mat dim;
  image_.convertTo(dim, CV_8UC1, 0.5, 60);
  ImagePyramid pyramid;
  ASSERT_TRUE(pyramid.Build(dim).ok());
  PatchSearcher searcher({});
  const SearchResult result = searcher.Find(pyramid, PatchAt({150, 100}), {152.0, 101.0},
                                            Eigen::Matrix2d::Identity() * 4.0);
  ASSERT_TRUE(result.found());
  EXPECT_GT(result.zncc, 0.99);
  EXPECT_NEAR((result.pixel - Eigen::Vector2d(150, 100)).norm(), 0.0, 0.02);
}

TEST(PatchSearch, ReportsARepeatedPatternAsAmbiguous) {
  cv::Mat image(200, 200, CV_8UC1);
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(
          128 + 60 * std::sin(2 * M_PI * x / 8.0) + 50 * std::sin(2 * M_PI * y / 9.0));
    }
  }
  ImagePyramid pyramid;
  ASSERT_TRUE(pyramid.Build(image).ok());
  WarpedPatch patch;
  ASSERT_EQ(CopyPatch(*CutPatch(image, {100, 100}, Pinhole(200, 200)), {}, patch), WarpStatus::kOk);
  PatchSearcher searcher({});
  const SearchResult result =
      searcher.Find(pyramid, patch, {100, 100}, Eigen::Matrix2d::Identity() * 8.0);
  ASSERT_TRUE(result.found());
  EXPECT_GT(result.rival_zncc, 0.95);
  EXPECT_LT((result.pixel - Eigen::Vector2d(100, 100)).norm(), 0.05);
}

TEST(PatchSearch, BlankPictureNeverMatches) {
  const cv::Mat blank(200, 200, CV_8UC1, cv::Scalar(90));
  ImagePyramid pyramid;
  ASSERT_TRUE(pyramid.Build(blank).ok());
  const TexturedPlane plane(8, 4.0 / 300);
  const auto camera = Pinhole(200, 200);
  const cv::Mat image = plane.Render(*camera, Pose({0, 0, 0}, {0, 0, -1}));
  WarpedPatch patch;
  ASSERT_EQ(CopyPatch(*CutPatch(image, {100, 100}, camera), {}, patch), WarpStatus::kOk);
  PatchSearcher searcher({});
  EXPECT_EQ(searcher.Find(pyramid, patch, {100, 100}, Eigen::Matrix2d::Identity() * 4).status,
            SearchStatus::kNoMatch);
}

}  // namespace
}  // namespace saccade::search_test
