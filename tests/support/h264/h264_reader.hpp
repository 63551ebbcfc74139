#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace saccade::testing {

/// Types of the NAL units of an Annex B access unit, in order.
std::vector<int> NalTypes(const std::string& access_unit);

/// OpenH264's decoder without error concealment: what was not sent is not made up.
class H264Reader {
 public:
  H264Reader();
  ~H264Reader();
  /// The luma plane, or an empty image if the access unit cannot be decoded.
  cv::Mat DecodeLuma(const std::string& access_unit);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Peak signal to noise ratio of two CV_8UC1 images [dB].
double Psnr(const cv::Mat& a, const cv::Mat& b);

}  // namespace saccade::testing
