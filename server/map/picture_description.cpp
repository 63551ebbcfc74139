#include "server/map/picture_description.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kRadius = 15;  // of the disc that gives the orientation [px of the level]
constexpr int kBorder = 18;  // descriptors keep this distance from a level's border [px]

/// Direction from the middle to the centroid of grey over a disc [degrees, 0 to 360].
float Orientation(const cv::Mat& image, int x, int y) {
  static const std::array<int, kRadius + 1> kHalfWidths = [] {
    std::array<int, kRadius + 1> widths{};
    for (int v = 0; v <= kRadius; ++v) {
      widths[v] = static_cast<int>(std::lround(std::sqrt(kRadius * kRadius - v * v)));
    }
    return widths;
  }();
  int moment_x = 0;
  int moment_y = 0;
  for (int v = -kRadius; v <= kRadius; ++v) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y + v) + x;
    const int width = kHalfWidths[std::abs(v)];
    int sum = 0;
    for (int u = -width; u <= width; ++u) {
      moment_x += u * row[u];
      sum += row[u];
    }
    moment_y += v * sum;
  }
  const double angle = std::atan2(moment_y, moment_x) * 180.0 / CV_PI;
  return static_cast<float>(angle < 0 ? angle + 360.0 : angle);
}

}  // namespace

std::vector<DescribedPoint> DescribePixels(const cv::Mat& grey,
                                           std::span<const Eigen::Vector2d> pixels) {
  std::vector<DescribedPoint> points(pixels.size());
  for (std::size_t k = 0; k < pixels.size(); ++k) points[k].pixel = pixels[k];
  // One level at a time through ORB with a single level of its own.
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(static_cast<int>(pixels.size()) + 1, 1.2F, 1,
                                               kBorder, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20);
  cv::Mat level = grey;
  double scale = 1.0;
  for (int s = 0; s < DescribedPoint::kScales; ++s, scale *= DescribedPoint::kScaleStep) {
    if (s > 0) {
      cv::resize(grey, level,
                 cv::Size(static_cast<int>(std::lround(grey.cols / scale)),
                          static_cast<int>(std::lround(grey.rows / scale))),
                 0, 0, cv::INTER_AREA);
    }
    const Eigen::Array2d ratio(static_cast<double>(level.cols) / grey.cols,
                               static_cast<double>(level.rows) / grey.rows);
    const cv::Rect inside(kBorder, kBorder, level.cols - 2 * kBorder, level.rows - 2 * kBorder);
    std::vector<cv::KeyPoint> places;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      if (!pixels[k].allFinite()) continue;
      const Eigen::Array2d at = (pixels[k].array() + 0.5) * ratio - 0.5;
      const cv::Point middle(static_cast<int>(std::lround(at.x())),
                             static_cast<int>(std::lround(at.y())));
      if (!inside.contains(middle)) continue;
      places.emplace_back(static_cast<float>(at.x()), static_cast<float>(at.y()), 31.0F,
                          Orientation(level, middle.x, middle.y), 1.0F, 0, static_cast<int>(k));
    }
    if (places.empty()) continue;
    cv::Mat bits;
    orb->compute(level, places, bits);
    for (std::size_t row = 0; row < places.size(); ++row) {
      DescribedPoint& point = points[places[row].class_id];
      std::memcpy(point.descriptors[s].data(), bits.ptr(static_cast<int>(row)), 32);
      point.present[s] = true;
    }
  }
  return points;
}

int PointDistance(const DescribedPoint& a, const DescribedPoint& b, int limit) {
  constexpr std::array<std::array<int, 2>, 6> kPairs = {
      {{0, 0}, {1, 1}, {0, 1}, {1, 0}, {0, 2}, {2, 0}}};
  const int half_limit = limit >= 256 ? 256 : limit / 2 + 12;  // 2.6 sigma of 128 bits at 85 / 256
  int least = 257;
  for (const auto& [s, t] : kPairs) {
    if (!a.present[s] || !b.present[t]) continue;
    const Descriptor& x = a.descriptors[s];
    const Descriptor& y = b.descriptors[t];
    const int half = std::popcount(x[0] ^ y[0]) + std::popcount(x[1] ^ y[1]);
    if (half > half_limit) continue;
    least = std::min(least, half + std::popcount(x[2] ^ y[2]) + std::popcount(x[3] ^ y[3]));
  }
  return least;
}

cv::Mat Thumbnail(const cv::Mat& grey) {
  cv::Mat small, blurred;
  cv::resize(grey, small, cv::Size(40, 30), 0, 0, cv::INTER_AREA);
  small.convertTo(small, CV_32FC1);
  cv::GaussianBlur(small, blurred, cv::Size(0, 0), 2.0);
  blurred -= cv::mean(blurred)[0];
  const double norm = cv::norm(blurred);
  if (norm > 1e-3) blurred /= norm;
  return blurred.reshape(1, 1);
}

}  // namespace saccade
