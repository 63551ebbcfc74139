#include "server/overlay/picture_painter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "shared/marks/shape_lines.hpp"

namespace saccade {
namespace {

constexpr double kNearM = 0.02;
constexpr int kStep = 8;              // px between what is worked out exactly
constexpr float kOutside = -1e6F;     // of the pinned picture
constexpr int kEdgePoints = 8;        // per edge, to find how far it reaches
constexpr double kLeastShrink = 0.7;  // below, the picture is made smaller first

/// The plane that the picture stands in, seen from the camera.
struct Plane {
  Eigen::Vector3d corner, right, up, normal;  // lower left; along the edges, whole
  double width2 = 0, height2 = 0;             // squares of the edges' lengths

  /// Where the line of sight meets it: 0 to 1 along right and up.
  std::optional<Eigen::Vector2d> Meet(const Eigen::Vector3d& bearing) const {
    const double cosine = bearing.dot(normal);
    const double t = corner.dot(normal) / cosine;
    if (!std::isfinite(t) || t < kNearM) return std::nullopt;
    const Eigen::Vector3d from_corner = t * bearing - corner;
    return Eigen::Vector2d(from_corner.dot(right) / width2, from_corner.dot(up) / height2);
  }
};

std::optional<cv::Rect> Bounds(const CameraModel& camera, const Plane& plane,
                               const cv::Size& size) {
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (int i = 0; i <= kEdgePoints; ++i) {
    const double t = static_cast<double>(i) / kEdgePoints;
    for (const auto& [a, b] : {std::pair(t, 0.0), {t, 1.0}, {0.0, t}, {1.0, t}}) {
      const Eigen::Vector3d point = plane.corner + a * plane.right + b * plane.up;
      if (!(point.z() > kNearM)) return std::nullopt;
      const std::optional<Eigen::Vector2d> pixel = camera.Project(point);
      if (!pixel || !pixel->allFinite()) return std::nullopt;
      low = low.cwiseMin(*pixel);
      high = high.cwiseMax(*pixel);
    }
  }
  low = low.cwiseMax(Eigen::Vector2d(0, 0));
  high = high.cwiseMin(Eigen::Vector2d(size.width - 1, size.height - 1));
  const cv::Point a(static_cast<int>(std::floor(low.x())), static_cast<int>(std::floor(low.y())));
  const cv::Point b(static_cast<int>(std::ceil(high.x())) + 1,
                    static_cast<int>(std::ceil(high.y())) + 1);
  const cv::Rect bounds = cv::Rect(a, b) & cv::Rect(cv::Point(0, 0), size);
  if (high.x() < low.x() || high.y() < low.y() || bounds.area() == 0) return std::nullopt;
  return bounds;
}

/// For each pixel of `bounds`, which of the pinned picture it shows: exact every few pixels,
/// between them straight.
cv::Mat Map(const CameraModel& camera, const Plane& plane, const cv::Rect& bounds,
            const cv::Size& pinned) {
  const cv::Size nodes((bounds.width + kStep - 1) / kStep + 1,
                       (bounds.height + kStep - 1) / kStep + 1);
  cv::Mat exact(nodes, CV_32FC2);
  for (int row = 0; row < nodes.height; ++row) {
    for (int column = 0; column < nodes.width; ++column) {
      const Eigen::Vector2d pixel(bounds.x + kStep * column, bounds.y + kStep * row);
      const std::optional<Eigen::Vector3d> bearing = camera.Unproject(pixel);
      const auto at = bearing ? plane.Meet(*bearing) : std::nullopt;
      exact.at<cv::Vec2f>(row, column) =
          at ? cv::Vec2f(static_cast<float>(at->x() * pinned.width - 0.5),
                         static_cast<float>((1.0 - at->y()) * pinned.height - 0.5))
             : cv::Vec2f(kOutside, kOutside);
    }
  }
  cv::Mat map(bounds.size(), CV_32FC2);
  for (int v = 0; v < bounds.height; ++v) {
    const int row = v / kStep;
    const float b = static_cast<float>(v % kStep) / kStep;
    const int next_row = std::min(row + 1, nodes.height - 1);
    for (int u = 0; u < bounds.width; ++u) {
      const int column = u / kStep;
      const float a = static_cast<float>(u % kStep) / kStep;
      const int next = std::min(column + 1, nodes.width - 1);
      const cv::Vec2f upper =
          exact.at<cv::Vec2f>(row, column) * (1 - a) + exact.at<cv::Vec2f>(row, next) * a;
      const cv::Vec2f lower =
          exact.at<cv::Vec2f>(next_row, column) * (1 - a) + exact.at<cv::Vec2f>(next_row, next) * a;
      map.at<cv::Vec2f>(v, u) = upper * (1 - b) + lower * b;
    }
  }
  return map;
}

/// Not much larger than it is drawn, or its letters flicker.
cv::Mat Shrunk(const cv::Mat& pixels, const Plane& plane, const CameraModel& camera) {
  const Eigen::Vector3d middle = plane.corner + 0.5 * plane.right + 0.5 * plane.up;
  const double width_px = std::sqrt(plane.width2) / std::max(kNearM, middle.norm()) /
                          std::max(1e-6, camera.RadiansPerPixel());
  const double share = width_px / pixels.cols;
  if (!(share < kLeastShrink)) return pixels;
  const cv::Size size(std::max(1, cvRound(share * pixels.cols)),
                      std::max(1, cvRound(share * pixels.rows)));
  cv::Mat small;
  cv::resize(pixels, small, size, 0, 0, cv::INTER_AREA);
  return small;
}

}  // namespace

void DrawPinnedPicture(const CameraModel& camera, const Rigid3& world_from_camera,
                       const Annotation& annotation, const cv::Mat& pixels, cv::Mat& onto) {
  const std::array<Eigen::Vector3d, 4> corners = PictureCorners(annotation, world_from_camera);
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  Plane plane;
  plane.corner = camera_from_world * corners[0];
  plane.right = camera_from_world * corners[1] - plane.corner;
  plane.up = camera_from_world * corners[3] - plane.corner;
  plane.normal = plane.right.cross(plane.up);
  plane.width2 = plane.right.squaredNorm();
  plane.height2 = plane.up.squaredNorm();
  if (!(plane.width2 > 0) || !(plane.height2 > 0) || !plane.corner.allFinite()) return;
  const std::optional<cv::Rect> bounds = Bounds(camera, plane, onto.size());
  if (!bounds) return;
  const cv::Mat drawn = Shrunk(pixels, plane, camera);
  const cv::Mat map = Map(camera, plane, *bounds, drawn.size());
  cv::Mat part = onto(*bounds);
  cv::remap(drawn, part, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
}

}  // namespace saccade
