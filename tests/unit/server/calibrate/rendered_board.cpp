#include "tests/unit/server/calibrate/rendered_board.hpp"

#include <cmath>
#include <opencv2/calib3d.hpp>

namespace saccade::testing {
namespace {

constexpr int kParts = 3;
constexpr float kWhite = 205, kBlack = 35, kWall = 120;

}  // namespace

BoardCamera::BoardCamera(const CameraIntrinsics& lens, const BoardPattern& pattern)
    : lens_(lens), pattern_(pattern) {
  const CameraModel model(lens);
  for (int y = 0; y < lens.height * kParts; ++y) {
    for (int x = 0; x < lens.width * kParts; ++x) {
      const auto ray = model.Unproject({(x + 0.5) / kParts - 0.5, (y + 0.5) / kParts - 0.5});
      rays_.push_back(ray && ray->z() > 0.01 ? cv::Vec3f(static_cast<float>(ray->x() / ray->z()),
                                                         static_cast<float>(ray->y() / ray->z()), 1)
                                             : cv::Vec3f(0, 0, 0));
    }
  }
}

cv::Mat BoardCamera::Draw(const cv::Matx33d& turn, const cv::Vec3d& at, double noise,
                          std::mt19937& random) const {
  const cv::Vec3d normal(turn(0, 2), turn(1, 2), turn(2, 2));
  const double distance = normal.dot(at);
  const cv::Matx33d back = turn.t();
  cv::Mat sum(lens_.height, lens_.width, CV_32F, cv::Scalar(0));
  for (std::size_t k = 0; k < rays_.size(); ++k) {
    const cv::Vec3d ray(rays_[k]);
    const double along = normal.dot(ray);
    float grey = kWall;
    if (ray[2] > 0 && along * distance > 0) {
      const cv::Vec3d on = back * (distance / along * ray - at);
      const double i = std::floor(on[0] / pattern_.square_m + 1);
      const double j = std::floor(on[1] / pattern_.square_m + 1);
      const bool squares = i >= 0 && j >= 0 && i <= pattern_.columns && j <= pattern_.rows;
      const bool margin = i >= -1 && j >= -1 && i <= pattern_.columns + 1 && j <= pattern_.rows + 1;
      if (squares) {
        grey = (static_cast<int>(i + j) % 2) != 0 ? kWhite : kBlack;
      } else if (margin) {
        grey = kWhite;
      }
    }
    const int x = static_cast<int>(k % (lens_.width * kParts)) / kParts;
    const int y = static_cast<int>(k / (lens_.width * kParts)) / kParts;
    sum.at<float>(y, x) += grey / (kParts * kParts);
  }
  std::normal_distribution<float> error(0, static_cast<float>(noise));
  for (float& value : cv::Mat_<float>(sum)) value += error(random);
  cv::Mat picture;
  sum.convertTo(picture, CV_8U);
  return picture;
}

std::vector<cv::Mat> ShownBoard(const BoardCamera& camera, const BoardPattern& pattern, int count,
                                double tilt_deg, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const CameraModel model(camera.lens());
  const double width_m = (pattern.columns + 1) * pattern.square_m;
  std::vector<cv::Mat> pictures;
  while (static_cast<int>(pictures.size()) < count) {
    const Eigen::Vector2d pixel(camera.lens().width * (0.5 + 0.36 * unit(random)),
                                camera.lens().height * (0.5 + 0.36 * unit(random)));
    const auto ray = model.Unproject(pixel);
    if (!ray) continue;
    const double tilt = tilt_deg * CV_PI / 180;
    cv::Matx33d turn;
    cv::Rodrigues(cv::Vec3d(tilt * unit(random), tilt * unit(random), 0.2 * unit(random)), turn);
    // Fills a third to two thirds of the picture's width.
    const double depth =
        width_m * camera.lens().fx / camera.lens().width / (0.5 + 0.16 * unit(random));
    const cv::Vec3d middle(0.5 * (pattern.columns - 1) * pattern.square_m,
                           0.5 * (pattern.rows - 1) * pattern.square_m, 0);
    const cv::Vec3d at =
        cv::Vec3d(ray->x(), ray->y(), ray->z()) * (depth / ray->z()) - turn * middle;
    bool inside = true;  // with its margin, but for the corner squares'
    for (const cv::Point3d& point : pattern.Points()) {
      const cv::Vec3d seen = turn * cv::Vec3d(point.x, point.y, 0) + at;
      const auto corner = model.Project({seen[0], seen[1], seen[2]});
      inside = inside && corner && model.InImage(*corner, 12);
    }
    if (inside) pictures.push_back(camera.Draw(turn, at, noise, random));
  }
  return pictures;
}

}  // namespace saccade::testing
