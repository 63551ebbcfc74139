#include "server/app/crop_view.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kGrid_px = 8;  // the map is smooth: between grid points a line is exact to 0.01 px
constexpr float kNowhere = -1e4F;

}  // namespace

cv::Mat CropView(const cv::Mat& picture, const CameraModel& camera, const CameraIntrinsics& view,
                 const Eigen::Quaterniond& camera_from_view) {
  const int columns = view.width / kGrid_px + 2, rows = view.height / kGrid_px + 2;
  const Eigen::Matrix3d turn = camera_from_view.toRotationMatrix();
  cv::Mat grid(rows, columns, CV_32FC2);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const Eigen::Vector3d bearing((c * kGrid_px - view.cx) / view.fx,
                                    (r * kGrid_px - view.cy) / view.fy, 1.0);
      const std::optional<Eigen::Vector2d> pixel = camera.Project(turn * bearing);
      grid.at<cv::Vec2f>(r, c) =
          pixel ? cv::Vec2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
                : cv::Vec2f(kNowhere, kNowhere);
    }
  }
  cv::Mat map(view.height, view.width, CV_32FC2);
  for (int y = 0; y < view.height; ++y) {
    const int r = y / kGrid_px;
    const float down = static_cast<float>(y % kGrid_px) / kGrid_px;
    for (int x = 0; x < view.width; ++x) {
      const int c = x / kGrid_px;
      const float right = static_cast<float>(x % kGrid_px) / kGrid_px;
      const cv::Vec2f above =
          (1 - right) * grid.at<cv::Vec2f>(r, c) + right * grid.at<cv::Vec2f>(r, c + 1);
      const cv::Vec2f below =
          (1 - right) * grid.at<cv::Vec2f>(r + 1, c) + right * grid.at<cv::Vec2f>(r + 1, c + 1);
      map.at<cv::Vec2f>(y, x) = (1 - down) * above + down * below;
    }
  }
  cv::Mat cropped;
  cv::remap(picture, cropped, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return cropped;
}

void DrawGuidance(double angle_rad, cv::Mat& picture) {
  const double half_width = 0.5 * picture.cols, half_height = 0.5 * picture.rows;
  const double margin = 0.06 * picture.rows, length = 0.12 * picture.rows;
  const double cosine = std::cos(angle_rad), sine = std::sin(angle_rad);
  // Where the ray from the middle leaves a frame inside the picture.
  const double reach = std::min((half_width - margin) / std::max(std::abs(cosine), 1e-9),
                                (half_height - margin) / std::max(std::abs(sine), 1e-9));
  const cv::Point tip(static_cast<int>(std::lround(half_width + reach * cosine)),
                      static_cast<int>(std::lround(half_height + reach * sine)));
  const cv::Point tail(static_cast<int>(std::lround(tip.x - length * cosine)),
                       static_cast<int>(std::lround(tip.y - length * sine)));
  const int thick = std::max(2, picture.rows / 100);
  cv::arrowedLine(picture, tail, tip, cv::Scalar::all(0), 3 * thick, cv::LINE_AA, 0, 0.5);
  cv::arrowedLine(picture, tail, tip, cv::Scalar::all(255), thick, cv::LINE_AA, 0, 0.5);
}

}  // namespace saccade
