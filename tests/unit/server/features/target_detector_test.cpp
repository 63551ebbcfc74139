#include "server/features/target_detector.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <random>

#include "shared/geometry/so3.hpp"
#include "tests/unit/server/features/recording.hpp"

namespace saccade::target_detector_test {
namespace {

double Degrees(double radians) { return radians * 180.0 / M_PI; }

ChessboardTarget Board() {
  return {
      9, 6, 0.04,
      std::array<Eigen::Vector2d, 3>{Eigen::Vector2d(248.8, 104.2), Eigen::Vector2d(562.6, 124.0),
                                     Eigen::Vector2d(205.7, 298.2)}};
}

/// A drawn board of 9 x 6 inner corners seen by `camera` from `pose`, 3 x 3 rays a pixel.
cv::Mat DrawBoard(const CameraModel& camera, const Rigid3& pose) {
  cv::Mat image(camera.height(), camera.width(), CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      double sum = 0;
      for (int k = 0; k < 9; ++k) {
        const auto ray = camera.Unproject({u + (k % 3 - 1) / 3.0, v + (k / 3 - 1) / 3.0});
        double grey = 200;
        if (ray) {
          const Eigen::Vector3d d = pose.rotation * *ray;
          const Eigen::Vector3d p = pose.translation - d * (pose.translation.z() / d.z());
          const int i = static_cast<int>(std::floor(p.x() / 0.04)) + 1;
          const int j = static_cast<int>(std::floor(p.y() / 0.04)) + 1;
          const bool inside = d.z() > 0 && i >= 0 && j >= 0 && i < 10 && j < 7;
          if (inside && (i + j) % 2 == 0) grey = 30;
        }
        sum += grey;
      }
      image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(sum / 9 + 0.5);
    }
  }
  return image;
}

TEST(Chessboard, PoseOfTheRecordingsFirstFrames) {
  const Recording recording("checkerboard");
  if (!recording.present()) GTEST_SKIP() << "needs ../shared/data/checkerboard";
  const auto camera = CheckerboardCamera();
  std::optional<Rigid3> previous;
  double worst_mm = 0, worst_deg = 0, worst_ms = 0;
  for (int frame = 0; frame < 30; ++frame) {
    ImagePyramid pyramid;
    ASSERT_TRUE(pyramid.Build(recording.Image(frame)).ok());
    const auto start = std::chrono::steady_clock::now();
    const auto seen = DetectChessboard(pyramid, *camera, Board(), previous);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    ASSERT_TRUE(seen.ok()) << frame << ": " << seen.status();
    const Rigid3 truth = recording.Truth(frame);
    const double mm = 1e3 * (seen->world_from_camera.translation - truth.translation).norm();
    const double deg = Degrees(RotationAngle(seen->world_from_camera, truth));
    if (frame == 0) {
      std::printf("checkerboard frame 0: %.2f mm, %.3f deg, rms %.3f px, sigma %.2f mm, %.1f ms\n",
                  mm, deg, seen->rms_px,
                  1e3 * std::sqrt(seen->pose_covariance.topLeftCorner<3, 3>().trace()),
                  took.count());
      EXPECT_LT((seen->pixels[0] - Eigen::Vector2d(248.8, 104.2)).norm(), 1.0);
    }
    worst_mm = std::max(worst_mm, mm);
    worst_deg = std::max(worst_deg, deg);
    worst_ms = std::max(worst_ms, took.count());
    EXPECT_FALSE(seen->ambiguous);
    previous = seen->world_from_camera;
  }
  std::printf("checkerboard frames 0 to 29: worst %.2f mm, %.3f deg, %.1f ms\n", worst_mm,
              worst_deg, worst_ms);
  EXPECT_LT(worst_mm, 5.0);
  EXPECT_LT(worst_deg, 0.5);
}

TEST(Chessboard, PoseOfADrawnBoardFromManySides) {
  const auto camera = CheckerboardCamera();
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d turn(0.4 * uniform(random), 0.4 * uniform(random), 0.5 * uniform(random));
    const Eigen::Quaterniond q = ExpQuaternion(turn);
    // Looks at the board's middle from about 0.6 m.
    const Rigid3 truth{q, Eigen::Vector3d(0.16, 0.10, 0) - q * Eigen::Vector3d(0, 0, 0.6)};
    ImagePyramid pyramid;
    ASSERT_TRUE(pyramid.Build(DrawBoard(*camera, truth)).ok());
    const auto seen = DetectChessboard(pyramid, *camera, {9, 6, 0.04, std::nullopt}, std::nullopt);
    ASSERT_TRUE(seen.ok()) << seen.status();
    EXPECT_LT((seen->world_from_camera.translation - truth.translation).norm(), 2e-3) << k;
    EXPECT_LT(Degrees(RotationAngle(seen->world_from_camera, truth)), 0.2) << k;
    EXPECT_LT(seen->rms_px, 0.15) << k;
  }
}

TEST(Chessboard, PredictedPoseDecidesTheHalfTurn) {
  const auto camera = CheckerboardCamera();
  const Eigen::Quaterniond upside_down = ExpQuaternion({0, 0, M_PI - 0.1});
  const Rigid3 truth{upside_down, {0.16, 0.10, -0.6}};
  ImagePyramid pyramid;
  ASSERT_TRUE(pyramid.Build(DrawBoard(*camera, truth)).ok());
  Rigid3 predicted = truth;
  predicted.translation += Eigen::Vector3d(0.05, -0.03, 0.04);
  const auto seen = DetectChessboard(pyramid, *camera, {9, 6, 0.04, std::nullopt}, predicted);
  ASSERT_TRUE(seen.ok()) << seen.status();
  EXPECT_LT((seen->world_from_camera.translation - truth.translation).norm(), 2e-3);
}

TEST(Chessboard, RefusesNonsense) {
  const auto camera = CheckerboardCamera();
  ImagePyramid pyramid;
  ASSERT_TRUE(pyramid.Build(cv::Mat(480, 752, CV_8UC1, cv::Scalar(128))).ok());
  EXPECT_EQ(DetectChessboard(pyramid, *camera, Board(), std::nullopt).status().code(),
            absl::StatusCode::kNotFound);
  ChessboardTarget bad = Board();
  bad.square_m = NAN;
  EXPECT_EQ(DetectChessboard(pyramid, *camera, bad, std::nullopt).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DetectChessboard(ImagePyramid(), *camera, Board(), std::nullopt).status().code(),
            absl::StatusCode::kInvalidArgument);
}

PatchTarget DeskTarget(const std::string& folder) {
  const std::array<Eigen::Vector3d, 4> points = {
      Eigen::Vector3d(-0.13477, -0.04074, 0), Eigen::Vector3d(0.04632, -0.04324, 0),
      Eigen::Vector3d(-0.13555, 0.08827, 0), Eigen::Vector3d(0.04969, 0.08697, 0)};
  PatchTarget target;
  for (int k = 0; k < 4; ++k) {
    const std::string path = folder + "/known_patch" + std::to_string(k) + ".pgm";
    target.points.push_back({k, points[k], cv::imread(path, cv::IMREAD_GRAYSCALE)});
  }
  return target;
}

StartPose DeskStart() {
  StartPose start;
  start.world_from_camera.translation = {0, 0, -0.6};
  start.position_sigma_m = 0.02;
  return start;
}

TEST(PatchTarget, FindsTheFourPatchesOfTheDesk) {
  const Recording recording("davison_desk");
  if (!recording.present()) GTEST_SKIP() << "needs ../shared/data/davison_desk";
  ImagePyramid pyramid;
  ASSERT_TRUE(pyramid.Build(recording.Image(0)).ok());
  const auto seen =
      DetectPatches(pyramid, DeskCamera(), DeskTarget(recording.folder()), DeskStart());
  ASSERT_TRUE(seen.ok()) << seen.status();
  for (std::size_t k = 0; k < seen->ids.size(); ++k) {
    std::printf("davison_desk frame 0: patch %d at (%.2f, %.2f)\n", seen->ids[k],
                seen->pixels[k].x(), seen->pixels[k].y());
  }
  const Eigen::Vector3d p = seen->world_from_camera.translation;
  std::printf("davison_desk frame 0: position (%.4f, %.4f, %.4f) m, turned %.2f deg, rms %.2f px\n",
              p.x(), p.y(), p.z(),
              Degrees(RotationAngle(seen->world_from_camera, DeskStart().world_from_camera)),
              seen->rms_px);
  EXPECT_EQ(seen->ids.size(), 4U);
  EXPECT_LT(seen->rms_px, 1.5);
  EXPECT_LT((p - Eigen::Vector3d(0, 0, -0.6)).norm(), 0.06);
}

TEST(PatchTarget, NamesTheReasonWhenItCannot) {
  const Recording recording("davison_desk");
  if (!recording.present()) GTEST_SKIP() << "needs ../shared/data/davison_desk";
  ImagePyramid pyramid;
  ASSERT_TRUE(pyramid.Build(cv::Mat(240, 320, CV_8UC1, cv::Scalar(50))).ok());
  PatchTarget target = DeskTarget(recording.folder());
  EXPECT_EQ(DetectPatches(pyramid, DeskCamera(), target, DeskStart()).status().code(),
            absl::StatusCode::kNotFound);
  StartPose away = DeskStart();
  away.world_from_camera.translation.z() = 0.6;
  EXPECT_EQ(DetectPatches(pyramid, DeskCamera(), target, away).status().code(),
            absl::StatusCode::kFailedPrecondition);
  target.points[2].templ = cv::Mat();
  const auto status = DetectPatches(pyramid, DeskCamera(), target, DeskStart()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("point 2"), std::string::npos) << status;
}

TEST(PoseFit, FindsThePoseAndItsCovarianceIsHonest) {
  const auto camera = CheckerboardCamera();
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Rigid3 truth{ExpQuaternion({0.2, -0.1, 0.3}), {0.1, -0.2, -1.5}};
  double nees = 0;
  const int runs = 100;
  for (int run = 0; run < runs; ++run) {
    std::vector<Eigen::Vector3d> points;
    std::vector<Eigen::Vector2d> pixels;
    while (points.size() < 30) {
      const Eigen::Vector3d in_camera(uniform(random), 0.6 * uniform(random),
                                      1.6 + 0.5 * uniform(random));
      const auto pixel = camera->Project(in_camera);
      if (!pixel || !camera->InImage(*pixel)) continue;
      points.push_back(truth * in_camera);
      pixels.push_back(*pixel + 0.5 * Eigen::Vector2d(normal(random), normal(random)));
    }
    Rigid3 initial = truth;
    initial.translation += Eigen::Vector3d(0.1, -0.1, 0.1);
    initial.rotation = initial.rotation * ExpQuaternion({0.1, 0.1, -0.1});
    const auto fit = FitPose(*camera, points, pixels, initial, {.sigma_px = 0.5, .huber_px = 5});
    ASSERT_TRUE(fit.ok()) << fit.status();
    Eigen::Matrix<double, 6, 1> error;
    error.head<3>() = fit->world_from_camera.translation - truth.translation;
    error.tail<3>() = LogQuaternion(truth.rotation.conjugate() * fit->world_from_camera.rotation);
    nees += error.dot(fit->covariance.ldlt().solve(error));
  }
  EXPECT_NEAR(nees / runs, 6.0, 1.3);
}

TEST(PoseFit, RansacSurvivesHalfOutliersAndRefusesNoise) {
  const auto camera = CheckerboardCamera();
  std::mt19937_64 random(10);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Rigid3 truth{ExpQuaternion({0.2, -0.1, 0.3}), {0.1, -0.2, -1.5}};
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> good, bad;
  while (points.size() < 60) {
    const Eigen::Vector3d in_camera(uniform(random), 0.6 * uniform(random),
                                    1.6 + 0.5 * uniform(random));
    const auto pixel = camera->Project(in_camera);
    if (!pixel || !camera->InImage(*pixel)) continue;
    const Eigen::Vector2d elsewhere(375 + 370 * uniform(random), 240 + 230 * uniform(random));
    good.push_back(points.size() % 2 == 0 ? *pixel : elsewhere);
    bad.push_back(elsewhere);
    points.push_back(truth * in_camera);
  }
  const auto pose = FitPoseRansac(*camera, points, good, {});
  ASSERT_TRUE(pose.ok()) << pose.status();
  EXPECT_GE(pose->inliers.size(), 30U);
  EXPECT_LE(pose->inliers.size(), 32U);
  EXPECT_LT((pose->fit.world_from_camera.translation - truth.translation).norm(), 5e-3);
  EXPECT_EQ(FitPoseRansac(*camera, points, bad, {}).status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace saccade::target_detector_test
