#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace saccade {

// Less is no picture, more is a mistake.
inline constexpr int kLeastBitRate_bit_s = 50'000, kMostBitRate_bit_s = 100'000'000;

struct VideoEncoderOptions {
  int width = 0;         // of the pictures [px], 16 to 4096; an odd last column is not coded
  int height = 0;        // likewise
  double fps_hz = 30.0;  // of the pictures given; sets the share of each
  /// 0: 2 Mbit/s at 640 x 480, in proportion to the area otherwise (about 39 dB on a desk scene).
  int bit_rate_bit_s = 0;

  absl::Status Validate() const;
};

/// One access unit, Annex B (start codes), H.264 constrained baseline.
struct EncodedPicture {
  std::shared_ptr<const std::string> data;
  bool key_frame = false;  // IDR; SPS and PPS come first in `data`
  /// 0, 1, 2: a picture refers to pictures of lower layers, and of its own only in layer 0. So all
  /// of layer 2, or of 2 and 1, may be left out.
  int temporal_layer = 0;
};

/// OpenH264 through its own API. One thread at a time; no thread of its own.
class VideoEncoder {
 public:
  /// InvalidArgument: options. Internal: the library refused them.
  static absl::StatusOr<std::unique_ptr<VideoEncoder>> Create(const VideoEncoderOptions& options);
  ~VideoEncoder();

  /// Codes `picture` (CV_8UC1 or CV_8UC3 BGR, the size of the options). Never skips one.
  /// `force_key_frame`: start anew, for somebody who has nothing yet.
  absl::StatusOr<EncodedPicture> Encode(const cv::Mat& picture, bool force_key_frame);

  /// How many pictures a second really come, where that is not what the options said: the bit rate
  /// is shared among them. At least a sixth of what they said, at most that: no picture is huge.
  void SetFrameRate(double fps_hz);

  int coded_width() const;   // [px], even
  int coded_height() const;  // [px], even

 private:
  class Impl;
  explicit VideoEncoder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
