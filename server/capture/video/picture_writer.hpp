#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/capture/decode_protocol.hpp"

struct AVFrame;
struct SwsContext;

namespace saccade {

/// One message of saccade-decode with what follows it. False: nobody reads any more.
bool Send(DecodeHeader header, const void* data = nullptr, std::size_t size = 0);
bool SendText(DecodeHeader header, const std::string& text);

/// One kError message.
void WriteError(const std::string& text);

/// libav's words.
std::string AvWords(int error);

/// Decoded pictures, as BGR or grey, to standard output. Lives as long as the process.
class PictureWriter {
 public:
  /// Before each SendFrame: why `frame` cannot be written; empty: it can.
  std::string Prepare(const AVFrame& frame);
  /// Fills in the rest of `header`. False: nobody reads any more.
  bool SendFrame(const AVFrame& frame, DecodeHeader header);

 private:
  SwsContext* scaler_ = nullptr;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace saccade
