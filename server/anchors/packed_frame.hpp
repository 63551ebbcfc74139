#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/capture/frame.hpp"

struct ZSTD_CCtx_s;

namespace saccade {

/// Bytes on pages of their own, which the system has back when they go. What lives for seconds
/// among allocations that live for milliseconds would leave holes behind: a fifth more memory.
class PageBytes {
 public:
  /// Throws std::bad_alloc.
  explicit PageBytes(std::span<const std::uint8_t> bytes);
  ~PageBytes();
  PageBytes(const PageBytes&) = delete;
  PageBytes& operator=(const PageBytes&) = delete;
  std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  std::span<std::uint8_t> bytes_;
};

/// One plane of 8-bit numbers without loss: what a pixel adds to its neighbours, then zstd.
struct PackedPlane {
  int rows = 0, cols = 0;
  std::shared_ptr<const PageBytes> data;  // null: there is none

  std::size_t size() const { return data ? data->bytes().size() : 0; }
};

/// A frame that is kept for later. The grey picture is kept bit by bit; of the colour, what it adds
/// to the grey (Cb, Cr) at half the resolution, as video has it: 0.19 MB of 640x480 pixels instead
/// of 1.2 MB.
struct PackedFrame {
  Frame head;  // without its pictures
  PackedPlane grey, cr, cb;

  bool has_color() const { return cr.data != nullptr; }
  std::size_t bytes() const;
};

/// Packs frames; 2 ms for 640x480. One thread at a time.
class FramePacker {
 public:
  FramePacker();
  ~FramePacker();
  FramePacker(const FramePacker&) = delete;
  FramePacker& operator=(const FramePacker&) = delete;

  PackedFrame Pack(const Frame& frame);

 private:
  PackedPlane PackPlane(const cv::Mat& plane);

  ZSTD_CCtx_s* const context_;
  std::vector<std::uint8_t> residuals_, buffer_;
};

/// 1 ms for 640x480, 3 ms with colour. Any thread.
std::shared_ptr<const Frame> Unpack(const PackedFrame& packed, bool with_color);

}  // namespace saccade
