#include "server/encode/i420.hpp"

#include <opencv2/imgproc.hpp>

namespace saccade {

void ToI420(const cv::Mat& picture, cv::Mat& i420) {
  const int width = picture.cols & ~1;
  const int height = picture.rows & ~1;
  const cv::Mat even = picture(cv::Rect(0, 0, width, height));
  if (picture.type() == CV_8UC3) {
    cv::cvtColor(even, i420, cv::COLOR_BGR2YUV_I420);
    return;
  }
  CV_Assert(picture.type() == CV_8UC1);
  i420.create(height * 3 / 2, width, CV_8UC1);
  even.convertTo(i420.rowRange(0, height), CV_8U, 219.0 / 255.0, 16.0);
  i420.rowRange(height, height * 3 / 2).setTo(128);
}

}  // namespace saccade
