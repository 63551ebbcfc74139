#include "tests/unit/server/markers/rendered_tags.hpp"

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr double kDark = 25, kBright = 225, kWall = 120;
constexpr double kLens_px = 0.7;  // what a good lens blurs
constexpr int kRays = 4;          // a side of a pixel

}  // namespace

RenderedSheet::RenderedSheet(const TagGrid& grid, const TagFamily& family)
    : grid_(grid), cell_m_(grid.side_m / family.cells()) {
  for (int id = 0; id < grid.tags(); ++id) {
    cv::Mat cells = cv::Mat::zeros(family.cells(), family.cells(), CV_8UC1);
    for (const TagFamily::Bit& bit : family.Bits(id)) {
      cells.at<std::uint8_t>(bit.row, bit.column) = bit.bright ? 1 : 0;
    }
    tags_.push_back(cells);
  }
}

double RenderedSheet::ShadeAt(double x_m, double y_m) const {
  const double gap = grid_.spacing * grid_.side_m, pitch = grid_.side_m + gap;
  const double width = grid_.columns * pitch - gap, height = grid_.rows * pitch - gap;
  if (x_m < -2 * gap || y_m < -2 * gap || x_m > width + 2 * gap || y_m > height + 2 * gap) {
    return kWall;
  }
  const double column = std::floor(x_m / pitch), row = std::floor(y_m / pitch);
  const double u = x_m - column * pitch, v = y_m - row * pitch;
  const bool in_columns = column >= 0 && column < grid_.columns;
  const bool in_rows = row >= 0 && row < grid_.rows;
  if (u < grid_.side_m && v < grid_.side_m && in_columns && in_rows) {
    const cv::Mat& tag =
        tags_[static_cast<std::size_t>(row) * grid_.columns + static_cast<std::size_t>(column)];
    const int across = std::min(tag.cols - 1, static_cast<int>(u / cell_m_));
    const int down = std::min(tag.rows - 1, static_cast<int>((grid_.side_m - v) / cell_m_));
    return tag.at<std::uint8_t>(down, across) != 0 ? kBright : kDark;
  }
  // The small squares where four tags' corners meet.
  const bool between = u >= grid_.side_m && v >= grid_.side_m;
  const bool there = column >= -1 && column < grid_.columns && row >= -1 && row < grid_.rows;
  return between && there ? kDark : kBright;
}

cv::Mat RenderedSheet::Seen(const CameraModel& camera, const Rigid3& camera_from_grid, double noise,
                            unsigned seed) const {
  const Rigid3 grid_from_camera = camera_from_grid.Inverse();
  cv::Mat picture(camera.height(), camera.width(), CV_32FC1);
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      double sum = 0;
      for (int k = 0; k < kRays * kRays; ++k) {
        const Eigen::Vector2d pixel(column + (k % kRays + 0.5) / kRays - 0.5,
                                    row + (k / kRays + 0.5) / kRays - 0.5);
        const auto bearing = camera.Unproject(pixel);
        const Eigen::Vector3d ray = bearing ? Eigen::Vector3d(grid_from_camera.rotation * *bearing)
                                            : Eigen::Vector3d::Zero();
        const double along = -grid_from_camera.translation.z() / ray.z();
        const Eigen::Vector3d at = grid_from_camera.translation + along * ray;
        sum += along > 0 && at.allFinite() ? ShadeAt(at.x(), at.y()) : kWall;
      }
      picture.at<float>(row, column) = static_cast<float>(sum / (kRays * kRays));
    }
  }
  cv::Mat grains(picture.size(), CV_32FC1);
  cv::RNG random(seed);
  random.fill(grains, cv::RNG::NORMAL, 0, noise);
  cv::GaussianBlur(picture, picture, {}, kLens_px);
  cv::Mat out;
  cv::Mat(picture + grains).convertTo(out, CV_8UC1);
  return out;
}

Rigid3 FacingSheet(const TagGrid& grid, double distance_m, double yaw, double pitch, double roll) {
  const double pitch_m = grid.side_m * (1 + grid.spacing);
  const Eigen::Vector3d middle(0.5 * (grid.columns * pitch_m - grid.spacing * grid.side_m),
                               0.5 * (grid.rows * pitch_m - grid.spacing * grid.side_m), 0);
  // The sheet's y is up, the camera's down.
  const Eigen::Quaterniond turn =
      Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(std::numbers::pi + pitch, Eigen::Vector3d::UnitX());
  return {turn, Eigen::Vector3d(0, 0, distance_m) - turn * middle};
}

}  // namespace saccade
