#pragma once

#include <opencv2/core.hpp>

namespace saccade {

/// Converts a grey (CV_8UC1) or BGR (CV_8UC3) picture to planar YUV 4:2:0, BT.601, luma 16 to 235.
///
/// `i420` becomes CV_8UC1, width x (height * 3 / 2), its memory reused. An odd last row or column
/// of the picture is left out: the pixels kept have the same coordinates.
void ToI420(const cv::Mat& picture, cv::Mat& i420);

}  // namespace saccade
