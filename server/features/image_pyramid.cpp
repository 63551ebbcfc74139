#include "server/features/image_pyramid.hpp"

#include <absl/strings/str_cat.h>

#include <opencv2/imgproc.hpp>

namespace saccade {

absl::Status ImagePyramid::Build(const cv::Mat& grey) {
  if (grey.type() != CV_8UC1 || grey.cols < 64 || grey.rows < 64) {
    const int type = grey.type();
    const int columns = grey.cols;
    const int rows = grey.rows;
    levels_[0] = cv::Mat();
    return absl::InvalidArgumentError(
        absl::StrCat("image: ", columns, " x ", rows, " of OpenCV type ", type,
                     "; give an 8-bit grey picture (CV_8UC1) of at least 64 x 64"));
  }
  levels_[0] = grey;
  for (int k = 1; k < kLevels; ++k) {
    const cv::Mat& finer = levels_[k - 1];
    const cv::Size half(finer.cols / 2, finer.rows / 2);
    const cv::Mat even = finer(cv::Rect(0, 0, 2 * half.width, 2 * half.height));
    cv::resize(even, levels_[k], half, 0, 0, cv::INTER_AREA);
  }
  return absl::OkStatus();
}

}  // namespace saccade
