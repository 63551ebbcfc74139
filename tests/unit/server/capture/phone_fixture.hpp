#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "server/capture/phone/phone_source.hpp"
#include "server/encode/video_encoder.hpp"

namespace saccade {

/// A picture that shows its number, in blocks that survive any coding, before a grey ramp.
inline cv::Mat NumberedPicture(int number, cv::Size size) {
  cv::Mat picture(size, CV_8UC1);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) picture.at<uchar>(v, u) = static_cast<uchar>(60 + u / 8);
  }
  for (int bit = 0; bit < 8; ++bit) {
    const double shade = (number >> bit & 1) != 0 ? 235 : 20;
    cv::rectangle(picture, cv::Rect(bit * 20, 0, 20, 20), cv::Scalar::all(shade), cv::FILLED);
  }
  return picture;
}

inline int NumberIn(const cv::Mat& grey) {
  int number = 0;
  for (int bit = 0; bit < 8; ++bit) {
    if (cv::mean(grey(cv::Rect(bit * 20 + 5, 5, 10, 10)))[0] > 128) number |= 1 << bit;
  }
  return number;
}

/// A phone as the source sees it, with an encoder of its own.
class FakePhone final : public PhoneLink {
 public:
  explicit FakePhone(cv::Size size = {320, 240}) : size_(size) {
    VideoEncoderOptions options;
    options.width = size.width;
    options.height = size.height;
    auto encoder = VideoEncoder::Create(options);
    EXPECT_TRUE(encoder.ok()) << encoder.status();
    if (encoder.ok()) encoder_ = *std::move(encoder);
  }

  void WantKeyFrame() override { ++asked_; }
  void Problem(const std::string& text) override {
    const std::lock_guard lock(mutex_);
    problem_ = text;
  }
  int asked() const { return asked_; }
  std::string problem() const {
    const std::lock_guard lock(mutex_);
    return problem_;
  }

  /// `number` is its id as well; captured now, on a clock that is not the server's.
  CodedPicture Code(int number, bool key, int clockwise_deg = 0) {
    const auto coded = encoder_->Encode(NumberedPicture(number, size_), key);
    EXPECT_TRUE(coded.ok()) << coded.status();
    CodedPicture picture;
    picture.picture_id = static_cast<std::uint64_t>(number);
    picture.key_frame = coded->key_frame;
    picture.capture_ns = MonotonicNow() + kAhead_ns;
    picture.clockwise_deg = clockwise_deg;
    picture.data = *coded->data;
    picture.received_ns = MonotonicNow();
    return picture;
  }

  static constexpr Timestamp kAhead_ns = 1'700'000'000'000'000'000;

 private:
  const cv::Size size_;
  std::unique_ptr<VideoEncoder> encoder_;
  std::atomic<int> asked_ = 0;
  mutable std::mutex mutex_;
  std::string problem_;
};

/// True once `what` is, within five seconds.
template <class What>
bool Soon(What what) {
  for (int i = 0; i < 500; ++i) {
    if (what()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

}  // namespace saccade
