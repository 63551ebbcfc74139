#include "server/sim/lens.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

/// Tangents of the viewing direction: x / z, y / z.
Eigen::Vector2d Tangents(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const std::optional<Eigen::Vector3d> bearing = camera.Unproject(pixel);
  if (!bearing || bearing->z() < 0.05) return Eigen::Vector2d::Zero();
  return bearing->head<2>() / bearing->z();
}

}  // namespace

Lens::Lens(const CameraModel& camera, double supersampling) {
  const int width = camera.width(), height = camera.height();
  Eigen::Array2d low(0, 0), high(0, 0);
  const auto cover = [&](double u, double v) {
    const Eigen::Array2d t = Tangents(camera, {u, v}).array();
    low = low.min(t);
    high = high.max(t);
  };
  for (int u = 0; u < width; ++u) {
    cover(u, 0);
    cover(u, height - 1);
  }
  for (int v = 0; v < height; ++v) {
    cover(0, v);
    cover(width - 1, v);
  }
  constexpr double kBorder = 2;  // drawn pixels beyond the last one needed
  view_.fx = camera.intrinsics().fx * supersampling;
  view_.fy = camera.intrinsics().fy * supersampling;
  view_.cx = kBorder - low.x() * view_.fx;
  view_.cy = kBorder - low.y() * view_.fy;
  view_.width = static_cast<int>(std::ceil(view_.cx + high.x() * view_.fx + kBorder)) + 1;
  view_.height = static_cast<int>(std::ceil(view_.cy + high.y() * view_.fy + kBorder)) + 1;

  cv::Mat exact(height, width, CV_32FC2);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector2d drawn = DrawnFromCamera(camera, Eigen::Vector2d(u, v));
      exact.at<cv::Vec2f>(v, u) = {static_cast<float>(drawn.x()), static_cast<float>(drawn.y())};
    }
  }
  cv::convertMaps(exact, cv::noArray(), map_, map_fraction_, CV_16SC2);
}

Eigen::Vector2d Lens::DrawnFromCamera(const CameraModel& camera,
                                      const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d t = Tangents(camera, pixel);
  return {view_.fx * t.x() + view_.cx, view_.fy * t.y() + view_.cy};
}

void Lens::Apply(const cv::Mat& drawn, cv::Mat& bgr) const {
  cv::Mat bent;
  Bend(drawn, bent);
  cv::cvtColor(bent, bgr, cv::COLOR_BGRA2BGR);
}

void Lens::Bend(const cv::Mat& drawn, cv::Mat& bent) const {
  cv::remap(drawn, bent, map_, map_fraction_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
}

}  // namespace saccade
