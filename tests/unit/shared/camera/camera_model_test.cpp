#include "shared/camera/camera_model.hpp"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

namespace saccade::camera_model_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

CameraModel Camera(LensModel model, std::array<double, 5> distortion, double f = 420.0) {
  CameraIntrinsics c;
  c.model = model;
  c.width = 640;
  c.height = 480;
  c.fx = f;
  c.fy = 0.99 * f;
  c.cx = 322.5;
  c.cy = 236.25;
  c.distortion = distortion;
  return CameraModel(c);
}

struct Case {
  const char* name;
  LensModel model;
  std::array<double, 5> distortion;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

const Case kCases[] = {
    {"pinhole", LensModel::kPinhole, {}},
    {"radial1_barrel", LensModel::kRadial1, {1.5e-6}},
    {"radial1_cushion", LensModel::kRadial1, {-0.7e-6}},
    {"brown_conrady_barrel", LensModel::kBrownConrady, {-0.2834, 0.0739, 0.0002, 0.00002, 0}},
    {"brown_conrady_fr1", LensModel::kBrownConrady, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
    {"kannala_brandt", LensModel::kKannalaBrandt, {-0.02, 0.011, -0.005, 0.0008}},
    {"fov", LensModel::kFov, {0.93}},
    {"fov_nearly_pinhole", LensModel::kFov, {1e-3}},
};

class EveryLens : public ::testing::TestWithParam<Case> {
 protected:
  CameraModel camera_ = Camera(GetParam().model, GetParam().distortion);
};
INSTANTIATE_TEST_SUITE_P(Models, EveryLens, ::testing::ValuesIn(kCases),
                         [](const auto& each) { return each.param.name; });

// T1: relative to the largest entry of the Jacobian.
TEST_P(EveryLens, ProjectionJacobianIsTheNumericOne) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> lateral(-0.7, 0.7), depth(0.3, 8.0);
  for (int i = 0; i < 1000; ++i) {
    const double z = depth(rng);
    const Vector3d point(lateral(rng) * z, lateral(rng) * z, z);
    Eigen::Matrix<double, 2, 3> analytic, numeric;
    ASSERT_TRUE(camera_.Project(point, &analytic));
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d h = 1e-5 * z * Vector3d::Unit(axis);
      numeric.col(axis) = (*camera_.Project(point + h) - *camera_.Project(point - h)) / (2e-5 * z);
    }
    ASSERT_LT((analytic - numeric).cwiseAbs().maxCoeff() / analytic.cwiseAbs().maxCoeff(), 1e-6)
        << point.transpose();
  }
}

TEST_P(EveryLens, BearingJacobianIsTheNumericOne) {
  std::mt19937 rng(2);
  std::uniform_real_distribution<double> u(1, 638), v(1, 478);
  for (int i = 0; i < 1000; ++i) {
    const Vector2d pixel(u(rng), v(rng));
    Eigen::Matrix<double, 3, 2> analytic, numeric;
    ASSERT_TRUE(camera_.Unproject(pixel, &analytic));
    for (int axis = 0; axis < 2; ++axis) {
      const Vector2d h = 0.02 * Vector2d::Unit(axis);
      numeric.col(axis) = (*camera_.Unproject(pixel + h) - *camera_.Unproject(pixel - h)) / 0.04;
    }
    ASSERT_LT((analytic - numeric).cwiseAbs().maxCoeff() / analytic.cwiseAbs().maxCoeff(), 1e-6)
        << pixel.transpose();
  }
}

TEST_P(EveryLens, OpticAxisFallsOnThePrincipalPoint) {
  Eigen::Matrix<double, 2, 3> jacobian;
  const auto pixel = camera_.Project({0, 0, 2}, &jacobian);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 322.5, 1e-12);
  EXPECT_NEAR(pixel->y(), 236.25, 1e-12);
  // The FOV lens magnifies its own axis: 2 tan(w / 2) / w.
  const double w = GetParam().distortion[0];
  const double f = GetParam().model == LensModel::kFov ? 210.0 * 2.0 * std::tan(0.5 * w) / w : 210;
  EXPECT_NEAR(jacobian(0, 0), f, 1e-9);
  EXPECT_NEAR(jacobian(1, 1), 0.99 * f, 1e-9);
  EXPECT_NEAR(jacobian(0, 2), 0.0, 1e-9);
  const auto bearing = camera_.Unproject({322.5, 236.25});
  ASSERT_TRUE(bearing);
  EXPECT_NEAR((*bearing - Vector3d::UnitZ()).norm(), 0.0, 1e-12);
}

TEST_P(EveryLens, RefusesWhatItCannotSee) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const Vector3d& point : {Vector3d(0, 0, -1), Vector3d(0, 0, 0), Vector3d(nan, 0, 1),
                                Vector3d(0, nan, 1), Vector3d(0, 0, nan), Vector3d(inf, 0, 1)}) {
    EXPECT_FALSE(camera_.Project(point)) << point.transpose();
  }
  EXPECT_FALSE(camera_.Unproject({nan, 1}));
  EXPECT_FALSE(camera_.Unproject({1, inf}));
}

/// T10: largest error of Project(Unproject(pixel)) over all pixels; infinite if one is refused.
double WorstRoundTrip_px(const CameraModel& camera) {
  double worst = 0.0;
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const auto bearing = camera.Unproject(Vector2d(u, v));
      if (!bearing) return std::numeric_limits<double>::infinity();
      const auto pixel = camera.Project(*bearing * 3.0);
      if (!pixel) return std::numeric_limits<double>::infinity();
      worst = std::max(worst, (*pixel - Vector2d(u, v)).norm());
      worst = std::max(worst, std::abs(bearing->norm() - 1.0));
    }
  }
  return worst;
}

TEST_P(EveryLens, RoundTripHoldsForEveryPixel) { EXPECT_LT(WorstRoundTrip_px(camera_), 1e-6); }

TEST(CameraModel, FisheyeRoundTripsToTheCorner79DegreesOut) {
  // f = 290 px puts the corner at about 1.38 rad: far outside what Brown-Conrady can hold.
  const CameraModel camera =
      Camera(LensModel::kKannalaBrandt, {-0.01, 0.004, -0.001, 0.0001}, /*f=*/290.0);
  EXPECT_LT(WorstRoundTrip_px(camera), 1e-6);
}

TEST(CameraModel, PointsBeyondTheTurningRadiusDoNotFoldBack) {
  // r (1 - 0.3 r^2) rises up to r = 1/sqrt(0.9) = 1.054 and then comes back to the picture.
  const CameraModel camera = Camera(LensModel::kBrownConrady, {-0.3, 0, 0, 0, 0});
  EXPECT_TRUE(camera.Project({1.05, 0, 1}));
  EXPECT_FALSE(camera.Project({1.06, 0, 1}));
  EXPECT_FALSE(camera.Project({1.8, 0, 1}));
  double previous = 0;
  for (double r = 0; r < 1.05; r += 0.01) {
    const double now = camera.Project({r, 0, 1})->x();
    EXPECT_GT(now, previous);
    previous = now;
  }
  // No ray arrives outside the largest distorted radius.
  EXPECT_FALSE(camera.Unproject({322.5 + 420 * 0.75, 236.25}));
  EXPECT_FALSE(camera.Unproject({5000, 236.25}));
}

TEST(CameraModel, Radial1MatchesItsFormula) {
  const CameraModel camera = Camera(LensModel::kRadial1, {9e-6}, 200.0);
  const auto pixel = camera.Project({0.5, 0, 1});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x() - 322.5, 100.0 / std::sqrt(1 + 2 * 9e-6 * 1e4), 1e-9);
}

TEST(CameraModel, FovMatchesItsFormulaAndRoundTripsToTheCorner72DegreesOut) {
  const CameraModel camera = Camera(LensModel::kFov, {0.95}, 300.0);
  const auto pixel = camera.Project({2, 0, 1});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x() - 322.5, 300.0 * std::atan(4.0 * std::tan(0.475)) / 0.95, 1e-9);
  const auto corner = camera.Unproject({0, 0});
  ASSERT_TRUE(corner);
  EXPECT_GT(std::acos(corner->z()) * 180 / 3.14159265, 72.0);
  EXPECT_LT(WorstRoundTrip_px(camera), 1e-6);
  EXPECT_FALSE(camera.Unproject({322.5 + 300.0 * 1.66, 236.25})) << "beyond 90 deg";
}

TEST(CameraModel, ImageEndsAtTheOuterPixelCentres) {
  const CameraModel camera = Camera(LensModel::kPinhole, {});
  EXPECT_TRUE(camera.InImage({0, 0}));
  EXPECT_TRUE(camera.InImage({639, 479}));
  EXPECT_FALSE(camera.InImage({639.1, 479}));
  EXPECT_FALSE(camera.InImage({5, 5}, 6));
}

TEST(CameraModel, EveryRecordingsCameraRoundTrips) {
  const std::filesystem::path root = SACCADE_SOURCE_DIR "/../shared/data";
  int cameras = 0;
  for (const char* name :
       {"davison_desk", "tum_fr1_xyz", "checkerboard", "apriltag_corner", "hall_imu"}) {
    const auto file = root / name / "camera.yaml";
    if (!std::filesystem::exists(file)) continue;
    const YAML::Node node = YAML::LoadFile(file.string());
    CameraIntrinsics c;
    const auto model = node["model"].as<std::string>();
    c.model = model == "radial1"         ? LensModel::kRadial1
              : model == "brown_conrady" ? LensModel::kBrownConrady
                                         : LensModel::kPinhole;
    c.width = node["width"].as<int>();
    c.height = node["height"].as<int>();
    c.fx = node["fx"].as<double>();
    c.fy = node["fy"].as<double>();
    c.cx = node["cx"].as<double>();
    c.cy = node["cy"].as<double>();
    for (std::size_t i = 0; i < node["distortion"].size(); ++i) {
      c.distortion[i] = node["distortion"][i].as<double>();
    }
    EXPECT_LT(WorstRoundTrip_px(CameraModel(c)), 1e-6) << name;
    ++cameras;
  }
  if (cameras == 0) GTEST_SKIP() << "none of ../shared/data's recordings is here";
}

}  // namespace
}  // namespace saccade::camera_model_test
