#pragma once

#include <Eigen/Dense>
#include <array>
#include <bit>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace saccade {

/// 256 bits of steered BRIEF (ORB).
using Descriptor = std::array<std::uint64_t, 4>;

inline int HammingDistance(const Descriptor& a, const Descriptor& b) {
  return std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) +
         std::popcount(a[3] ^ b[3]);
}

/// What is remembered of a place in a picture: one descriptor for each scale at which its
/// surroundings lie inside the picture.
struct DescribedPoint {
  static constexpr int kScales = 3;
  static constexpr double kScaleStep = 1.5;

  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // [px]
  std::array<Descriptor, kScales> descriptors{};    // of the picture shrunk by kScaleStep^k
  std::array<bool, kScales> present{};
};

/// Describes `pixels` of `grey` (CV_8UC1) at every scale. Entry k belongs to pixels[k]; places too
/// near the border have nothing present.
std::vector<DescribedPoint> DescribePixels(const cv::Mat& grey,
                                           std::span<const Eigen::Vector2d> pixels);

/// Least distance between two places over the pairs of scales that a change of distance by up to
/// kScaleStep^2 either way can bring together; 257 if they share none. Where half the bits show
/// that it is most probably beyond `limit`, 257 as well: several times as fast.
int PointDistance(const DescribedPoint& a, const DescribedPoint& b, int limit = 256);

/// The picture as 40 x 30 blurred pixels of zero mean and unit norm, CV_32FC1, 1 x 1200: the dot
/// product of two is their correlation.
cv::Mat Thumbnail(const cv::Mat& grey);

}  // namespace saccade
