#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace saccade::decode {

/// OpenH264 without error concealment: what was not sent is not made up. One thread at a time.
class VideoDecoder {
 public:
  /// Internal: the library refused.
  static absl::StatusOr<std::unique_ptr<VideoDecoder>> Create();
  ~VideoDecoder();
  VideoDecoder(const VideoDecoder&) = delete;
  VideoDecoder& operator=(const VideoDecoder&) = delete;

  /// The picture of one access unit (H.264, Annex B): CV_8UC4, R G B A.
  /// DataLoss: it cannot be decoded, now or at all; begin again at a key frame.
  absl::StatusOr<cv::Mat> Decode(const std::string& access_unit);

 private:
  class Impl;
  explicit VideoDecoder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade::decode
