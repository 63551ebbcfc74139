#include "server/calibrate/walls_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

namespace saccade::walls_fit_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kFocal_px = 610.0;

CameraIntrinsics Lens() {
  CameraIntrinsics lens;
  lens.width = 768;
  lens.height = 576;
  lens.fx = lens.fy = kFocal_px;
  lens.cx = 392.0;
  lens.cy = 281.0;
  return lens;
}

/// A file for eight squares, four on each of two walls that meet at a right angle.
std::string RoomFile() {
  const double h = std::sqrt(0.5);
  std::string text = "family: aruco_4x4_50\nsquares:\n";
  int id = 0;
  const auto add = [&](const Eigen::Vector3d& centre, const Eigen::Vector4d& q) {
    text += "  - {id: " + std::to_string(id++) + ", side_m: 0.4, centre_m: [" +
            std::to_string(centre.x()) + ", " + std::to_string(centre.y()) + ", " +
            std::to_string(centre.z()) + "], orientation_xyzw: [" + std::to_string(q[0]) + ", " +
            std::to_string(q[1]) + ", " + std::to_string(q[2]) + ", " + std::to_string(q[3]) +
            "]}\n";
  };
  for (const double y : {-0.4, 0.4}) {
    for (const double along : {0.5, 1.2}) add({along, y, 0.0}, {0, 0, 0, 1});  // faces +z
    for (const double along : {0.5, 1.2}) add({0.0, y, along}, {0, h, 0, h});  // faces +x
  }
  return text;
}

class Walls : public ::testing::Test {
 protected:
  static WallSquares Load(const std::string& text) { return *LoadWallSquares(Write(text)); }
  static std::filesystem::path Write(const std::string& text) {
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / "saccade_walls_test.yaml";
    std::ofstream(file) << text;
    return file;
  }
  /// What a camera in the room sees, each square drawn through its own homography, three times as
  /// large and made smaller.
  static cv::Mat Seen(const WallSquares& walls, const Eigen::Vector3d& at) {
    constexpr int kLarger = 3, kPrint_px = 600, kMargin_px = 100;
    const CameraModel camera(Lens());
    const Eigen::Vector3d ahead = (Eigen::Vector3d(0.45, 0.0, 0.45) - at).normalized();
    const Eigen::Vector3d right = ahead.cross(Eigen::Vector3d::UnitY()).normalized();
    Eigen::Matrix3d turn;
    turn << right, ahead.cross(right), ahead;
    const Rigid3 world_from_camera{Eigen::Quaterniond(turn), at};
    const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50);
    cv::Mat large(Lens().height * kLarger, Lens().width * kLarger, CV_8U, cv::Scalar(200));
    for (const auto& [id, square] : walls.squares) {
      cv::Mat print(kPrint_px + 2 * kMargin_px, kPrint_px + 2 * kMargin_px, CV_8U, cv::Scalar(255));
      cv::Mat inner = print(cv::Rect(kMargin_px, kMargin_px, kPrint_px, kPrint_px));
      cv::Mat marker;
      cv::aruco::drawMarker(dictionary, id, kPrint_px, marker);
      marker.copyTo(inner);
      const float low = kMargin_px - 0.5F, high = kMargin_px + kPrint_px - 0.5F;
      const cv::Point2f from[] = {{low, low}, {high, low}, {high, high}, {low, high}};
      cv::Point2f to[4];
      const auto corners = walls.Corners(id);
      for (int k = 0; k < 4; ++k) {
        const auto pixel = camera.Project(world_from_camera.Inverse() * corners[k]);
        to[k] = {static_cast<float>((pixel->x() + 0.5) * kLarger - 0.5),
                 static_cast<float>((pixel->y() + 0.5) * kLarger - 0.5)};
      }
      cv::warpPerspective(print, large, cv::getPerspectiveTransform(from, to), large.size(),
                          cv::INTER_AREA, cv::BORDER_TRANSPARENT);
    }
    cv::Mat seen;
    cv::resize(large, seen, {}, 1.0 / kLarger, 1.0 / kLarger, cv::INTER_AREA);
    cv::Mat noise(seen.size(), CV_16S);
    cv::theRNG().state = 5;
    cv::randn(noise, 0, 2);
    cv::add(seen, noise, seen, {}, CV_8U);
    return seen;
  }
  static PictureSet Only(const cv::Mat& picture) {
    return {
        "test", {"picture"}, [picture](std::size_t) -> absl::StatusOr<cv::Mat> { return picture; }};
  }
};

TEST_F(Walls, OneViewOfTwoWallsGivesTheFocalLengthToOnePercent) {
  const WallSquares walls = Load(RoomFile());
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(2.4, 0.1, 2.1), Eigen::Vector3d(2.0, -0.3, 2.6)}) {
    const auto fit = FitWalls(Only(Seen(walls, at)), walls, 0);
    ASSERT_TRUE(fit.ok()) << fit.status();
    EXPECT_EQ(fit->views.front().pixels.size(), 32);
    EXPECT_NEAR(fit->lens.fx, kFocal_px, 0.01 * kFocal_px);
    EXPECT_GT(fit->focal_sigma_px, 0.0);
    EXPECT_LT(fit->rms_px, 0.5);
  }
}

TEST_F(Walls, OneWallIsRefusedInThePictureAndInTheFile) {
  const WallSquares walls = Load(RoomFile());
  WallSquares half = walls;
  for (const int id : {2, 3, 6, 7}) half.squares.erase(id);
  const auto fit = FitWalls(Only(Seen(half, {2.4, 0.1, 2.1})), walls, 0);
  EXPECT_THAT(fit.status().message(), HasSubstr("both walls"));
  const auto flat = LoadWallSquares(
      Write("family: aruco_4x4_50\nsquares:\n"
            "  - {id: 0, side_m: 0.4, centre_m: [0, 0, 0], orientation_xyzw: [0, 0, 0, 1]}\n"
            "  - {id: 1, side_m: 0.4, centre_m: [1, 0, 0], orientation_xyzw: [0, 0, 0, 1]}\n"));
  EXPECT_THAT(flat.status().message(), AllOf(HasSubstr("squares"), HasSubstr("second wall")));
}

TEST_F(Walls, BadFilesAreRefusedByFieldAndRemedy) {
  EXPECT_THAT(LoadWallSquares(Write("family: circles\nsquares: []\n")).status().message(),
              HasSubstr("family"));
  EXPECT_THAT(
      LoadWallSquares(
          Write("family: aruco_4x4_50\nsquares:\n"
                "  - {id: 0, side_m: 0.4, centre_m: [0, 0, 0], orientation_xyzw: [0, 0, 0, 1]}\n"
                "  - {id: 0, side_m: 0.4, centre_m: [1, 0, 0], orientation_xyzw: [0, 0, 0, 1]}\n"))
          .status()
          .message(),
      AllOf(HasSubstr("id"), HasSubstr("twice")));
}

}  // namespace
}  // namespace saccade::walls_fit_test
