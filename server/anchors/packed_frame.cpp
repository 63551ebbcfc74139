#include "server/anchors/packed_frame.hpp"

#include <sys/mman.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kLevel = 1;  // noise has no repetitions to look for: more only takes longer

/// LOCO-I's guess of a pixel by those to its left, above, and above left (Weinberger et al., "The
/// LOCO-I lossless image compression algorithm", TIP 9(8), 2000).
int Guess(int left, int above, int corner) {
  const int low = std::min(left, above), high = std::max(left, above);
  return std::clamp(left + above - corner, low, high);
}

/// What each pixel is more than its guess, modulo 256.
void Residuals(const cv::Mat& plane, std::uint8_t* out) {
  for (int v = 0; v < plane.rows; ++v, out += plane.cols) {
    const std::uint8_t* row = plane.ptr(v);
    const std::uint8_t* above = v > 0 ? plane.ptr(v - 1) : nullptr;
    out[0] = static_cast<std::uint8_t>(row[0] - (above != nullptr ? above[0] : 0));
    for (int u = 1; u < plane.cols; ++u) {
      const int guess = above != nullptr ? Guess(row[u - 1], above[u], above[u - 1]) : row[u - 1];
      out[u] = static_cast<std::uint8_t>(row[u] - guess);
    }
  }
}

cv::Mat UnpackPlane(const PackedPlane& packed) {
  if (!packed.data) return {};
  cv::Mat plane(packed.rows, packed.cols, CV_8UC1);
  const std::span<const std::uint8_t> bytes = packed.data->bytes();
  const std::size_t size = plane.total();
  const std::size_t got = ZSTD_decompress(plane.data, size, bytes.data(), bytes.size());
  if (got != size) throw std::bad_alloc();  // of bytes that we packed: nothing else can fail
  for (int v = 0; v < plane.rows; ++v) {
    std::uint8_t* row = plane.ptr(v);
    const std::uint8_t* above = v > 0 ? plane.ptr(v - 1) : nullptr;
    row[0] = static_cast<std::uint8_t>(row[0] + (above != nullptr ? above[0] : 0));
    for (int u = 1; u < plane.cols; ++u) {
      const int guess = above != nullptr ? Guess(row[u - 1], above[u], above[u - 1]) : row[u - 1];
      row[u] = static_cast<std::uint8_t>(row[u] + guess);
    }
  }
  return plane;
}

cv::Mat ColorOf(const cv::Mat& grey, const PackedFrame& packed) {
  cv::Mat planes[3] = {grey, {}, {}};  // OpenCV's order: Y, Cr, Cb
  cv::resize(UnpackPlane(packed.cr), planes[1], grey.size(), 0, 0, cv::INTER_LINEAR);
  cv::resize(UnpackPlane(packed.cb), planes[2], grey.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat merged, color;
  cv::merge(planes, 3, merged);
  cv::cvtColor(merged, color, cv::COLOR_YCrCb2BGR);
  return color;
}

}  // namespace

PageBytes::PageBytes(std::span<const std::uint8_t> bytes) {
  void* const pages =
      ::mmap(nullptr, bytes.size(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) throw std::bad_alloc();
  std::memcpy(pages, bytes.data(), bytes.size());
  bytes_ = {static_cast<std::uint8_t*>(pages), bytes.size()};
}

PageBytes::~PageBytes() { ::munmap(bytes_.data(), bytes_.size()); }

std::size_t PackedFrame::bytes() const {
  return sizeof(PackedFrame) + grey.size() + cr.size() + cb.size();
}

FramePacker::FramePacker() : context_(ZSTD_createCCtx()) {
  if (context_ == nullptr) throw std::bad_alloc();
}

FramePacker::~FramePacker() { ZSTD_freeCCtx(context_); }

PackedPlane FramePacker::PackPlane(const cv::Mat& plane) {
  if (plane.empty()) return {};
  residuals_.resize(plane.total());
  Residuals(plane, residuals_.data());
  buffer_.resize(ZSTD_compressBound(residuals_.size()));
  const std::size_t size = ZSTD_compressCCtx(context_, buffer_.data(), buffer_.size(),
                                             residuals_.data(), residuals_.size(), kLevel);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();
  return {plane.rows, plane.cols,
          std::make_shared<const PageBytes>(std::span(buffer_).first(size))};
}

PackedFrame FramePacker::Pack(const Frame& frame) {
  PackedFrame packed;
  packed.head = frame;
  packed.head.grey = packed.head.color = cv::Mat();
  packed.grey = PackPlane(frame.grey);
  if (frame.color.empty()) return packed;
  cv::Mat whole, plane, half;
  cv::cvtColor(frame.color, whole, cv::COLOR_BGR2YCrCb);
  const cv::Size size((frame.color.cols + 1) / 2, (frame.color.rows + 1) / 2);
  for (const int channel : {1, 2}) {
    cv::extractChannel(whole, plane, channel);
    cv::resize(plane, half, size, 0, 0, cv::INTER_AREA);
    (channel == 1 ? packed.cr : packed.cb) = PackPlane(half);
  }
  return packed;
}

std::shared_ptr<const Frame> Unpack(const PackedFrame& packed, bool with_color) {
  auto frame = std::make_shared<Frame>(packed.head);
  frame->grey = UnpackPlane(packed.grey);
  if (with_color && packed.has_color()) frame->color = ColorOf(frame->grey, packed);
  return frame;
}

}  // namespace saccade
