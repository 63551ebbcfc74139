#pragma once

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/capture/v4l2/v4l2_source.hpp"
#include "tests/unit/server/capture/fake_camera.hpp"

namespace saccade {

inline constexpr int kWidth = 64, kHeight = 48;
inline constexpr Timestamp kMs = 1'000'000;

/// Smooth, coloured, and told from its own mirror images: red grows to the right, blue downwards.
inline cv::Mat Scene(int green = 60) {
  cv::Mat picture(kHeight, kWidth, CV_8UC3);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      picture.at<cv::Vec3b>(v, u) =
          cv::Vec3b(static_cast<uchar>(30 + 3 * v), static_cast<uchar>(green),
                    static_cast<uchar>(30 + 3 * u));
    }
  }
  return picture;
}

/// BT.601 in the video range, as cameras give it; `nv12`: else YUYV. Lines have `padding` more.
inline std::vector<std::uint8_t> Yuv(const cv::Mat& bgr, bool nv12, int padding = 0) {
  cv::Mat i420;
  cv::cvtColor(bgr, i420, cv::COLOR_BGR2YUV_I420);
  const uchar* y = i420.data;
  const uchar* u = y + kWidth * kHeight;
  const uchar* v = u + kWidth * kHeight / 4;
  const int line = (nv12 ? 1 : 2) * kWidth + padding;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(line) * kHeight * (nv12 ? 3 : 2) / 2,
                                  0x55);
  const auto chroma = [](int row, int column) { return row / 2 * kWidth / 2 + column / 2; };
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const uchar luma = y[row * kWidth + column];
      const uchar colour = (column % 2 == 0 ? u : v)[chroma(row, column)];
      if (nv12) {
        bytes[row * line + column] = luma;
        bytes[(kHeight + row / 2) * line + column] = colour;
      } else {
        bytes[row * line + 2 * column] = luma;
        bytes[row * line + 2 * column + 1] = colour;
      }
    }
  }
  if (!nv12) bytes.resize(static_cast<std::size_t>(line) * kHeight);
  return bytes;
}

inline std::vector<std::uint8_t> Jpeg(const cv::Mat& bgr) {
  std::vector<uchar> bytes;
  cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, 98});
  return bytes;
}

/// As many cameras give it: without Huffman tables, which everybody knows.
inline std::vector<std::uint8_t> WithoutTables(const std::vector<std::uint8_t>& jpeg) {
  std::vector<std::uint8_t> out(jpeg.begin(), jpeg.begin() + 2);
  for (std::size_t at = 2; at + 4 < jpeg.size();) {
    const std::size_t length = 2 + (std::size_t{jpeg[at + 2]} << 8 | jpeg[at + 3]);
    if (jpeg[at + 1] == 0xDA) {
      out.insert(out.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
      break;
    }
    const auto begin = jpeg.begin() + static_cast<std::ptrdiff_t>(at);
    if (jpeg[at + 1] != 0xC4) out.insert(out.end(), begin, begin + static_cast<long>(length));
    at += length;
  }
  return out;
}

inline double MeanDifference(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat difference;
  cv::absdiff(a, b, difference);
  const cv::Scalar mean = cv::mean(difference);
  return (mean[0] + mean[1] + mean[2]) / a.channels();
}

/// As a server opens a camera; `file`: its camera.yaml.
inline SourceOptions Live(const std::string& file = "") {
  SourceOptions options;
  options.realtime = true;
  options.camera_file = file;
  return options;
}

class V4l2 : public ::testing::Test {
 protected:
  void UseFormat(std::uint32_t fourcc) { camera_->modes = {{fourcc, kWidth, kHeight, {30, 15}}}; }
  absl::StatusOr<std::unique_ptr<CameraSource>> Open(const std::string& query = "",
                                                     const SourceOptions& options = Live()) {
    return OpenV4l2("/dev/video7" + query, options, FakeCamera::Opener(camera_));
  }
  void Start(const std::string& query = "") {
    source_.reset();  // one program at a time
    auto opened = Open(query);
    ASSERT_TRUE(opened.ok()) << opened.status();
    source_ = *std::move(opened);
  }
  std::string Refusal(const std::string& query) {
    const auto opened = Open(query);
    return std::string(opened.status().message());
  }
  /// The frame of one picture that is pushed while the reader waits.
  std::optional<Frame> Take(const FakeCamera::Shot& shot) {
    auto next = std::async(std::launch::async, [this] { return source_->Next(); });
    EXPECT_TRUE(camera_->Push(shot));
    absl::StatusOr<std::optional<Frame>> frame = next.get();
    EXPECT_TRUE(frame.ok());
    return frame.ok() ? *std::move(frame) : std::nullopt;
  }
  FakeCamera::Shot Shot(int green = 60) { return {.bytes = Yuv(Scene(green), false)}; }

  const std::shared_ptr<FakeCamera> camera_ = std::make_shared<FakeCamera>();
  std::unique_ptr<CameraSource> source_;
};

}  // namespace saccade
