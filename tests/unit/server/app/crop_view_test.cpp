#include "server/app/crop_view.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "shared/geometry/so3.hpp"
#include "tests/support/pinhole.hpp"

namespace saccade::crop_view_test {
namespace {

CameraIntrinsics Real() {
  CameraIntrinsics camera;
  camera.model = LensModel::kBrownConrady;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 458;
  camera.cx = 322;
  camera.cy = 238;
  camera.distortion = {-0.09, 0.035, 0.0006, -0.0004, 0.0};
  return camera;
}
CameraIntrinsics View() { return Pinhole(320, 240, 458); }

Eigen::Vector2d BrightestBlob(const cv::Mat& picture) {
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  const cv::Moments moments = cv::moments(grey);
  return {moments.m10 / moments.m00, moments.m01 / moments.m00};
}

TEST(CropView, ADirectionOfTheWorldLandsWhereTheVirtualCameraSeesIt) {
  const CameraModel camera(Real());
  for (const Eigen::Vector3d& turn : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.05, 0.2, 0.3),
                                      Eigen::Vector3d(-0.1, -0.15, -0.4)}) {
    const Eigen::Quaterniond camera_from_view = ExpQuaternion(turn);
    const Eigen::Vector3d seen(0.05, -0.08, 1);  // in the view
    const auto pixel = camera.Project(camera_from_view * seen);
    ASSERT_TRUE(pixel);
    cv::Mat picture(480, 640, CV_8UC3, cv::Scalar::all(0));
    cv::circle(picture,
               cv::Point(static_cast<int>(std::lround(16 * pixel->x())),
                         static_cast<int>(std::lround(16 * pixel->y()))),
               16 * 6, cv::Scalar::all(255), cv::FILLED, cv::LINE_AA, 4);
    const cv::Mat crop = CropView(picture, camera, View(), camera_from_view);
    ASSERT_EQ(crop.size(), cv::Size(320, 240));
    const Eigen::Vector2d found = BrightestBlob(crop);
    EXPECT_NEAR(found.x(), 159.5 + 458 * 0.05, 0.3);
    EXPECT_NEAR(found.y(), 119.5 - 458 * 0.08, 0.3);
  }
}

TEST(CropView, BlackBeyondThePicture) {
  const CameraModel camera(Real());
  const cv::Mat picture(480, 640, CV_8UC3, cv::Scalar::all(200));
  const cv::Mat crop = CropView(picture, camera, View(), ExpQuaternion({0, 1.2, 0}));
  EXPECT_EQ(crop.at<cv::Vec3b>(120, 310), cv::Vec3b(0, 0, 0));
}

TEST(CropView, TheGuidanceArrowIsAtTheEdgeItPointsTo) {
  cv::Mat picture(240, 320, CV_8UC3, cv::Scalar::all(128));
  DrawGuidance(3.14159, picture);  // left
  cv::Mat changed;
  cv::absdiff(picture, cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(128)), changed);
  cv::cvtColor(changed, changed, cv::COLOR_BGR2GRAY);
  const cv::Rect where = cv::boundingRect(changed);
  EXPECT_GT(where.area(), 100);
  EXPECT_LT(where.x + where.width, 80);
  EXPECT_NEAR(where.y + 0.5 * where.height, 120, 3);
}

}  // namespace
}  // namespace saccade::crop_view_test
