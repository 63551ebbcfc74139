#pragma once

#include <cstring>
#include <opencv2/core.hpp>

namespace saccade {

/// Whether two pictures are the same to the bit: a source that fills up its rate, or a frozen one.
inline bool SamePicture(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  const std::size_t bytes = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), bytes) != 0) return false;
  }
  return true;
}

}  // namespace saccade
