#include "server/capture/video/picture_writer.hpp"

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}
#include <unistd.h>

#include <cerrno>

namespace saccade {
namespace {

constexpr int kMostSide_px = 8192;

bool WriteAll(const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(kDecodeOut, at, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    at += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

bool IsGrey(AVPixelFormat format) {
  const AVPixFmtDescriptor* described = av_pix_fmt_desc_get(format);
  return described != nullptr && described->nb_components == 1;
}

}  // namespace

bool Send(DecodeHeader header, const void* data, std::size_t size) {
  header.size = static_cast<std::uint32_t>(size);
  return WriteAll(&header, sizeof header) && (size == 0 || WriteAll(data, size));
}

bool SendText(DecodeHeader header, const std::string& text) {
  return Send(header, text.data(), text.size());
}

void WriteError(const std::string& text) {
  DecodeHeader header;
  header.kind = DecodeHeader::kError;
  (void)SendText(header, text);
}

std::string AvWords(int error) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(error, text, sizeof text);
  return text;
}

std::string PictureWriter::Prepare(const AVFrame& frame) {
  if (frame.width > kMostSide_px || frame.height > kMostSide_px) return "it is too large";
  const auto format = static_cast<AVPixelFormat>(frame.format);
  const AVPixelFormat wanted = IsGrey(format) ? AV_PIX_FMT_GRAY8 : AV_PIX_FMT_BGR24;
  scaler_ =
      sws_getCachedContext(scaler_, frame.width, frame.height, format, frame.width, frame.height,
                           wanted, SWS_BICUBIC | SWS_ACCURATE_RND, nullptr, nullptr, nullptr);
  return scaler_ == nullptr ? "its pixel format is not read" : "";
}

bool PictureWriter::SendFrame(const AVFrame& frame, DecodeHeader header) {
  const bool grey = IsGrey(static_cast<AVPixelFormat>(frame.format));
  const int* source = sws_getCoefficients(frame.colorspace);
  sws_setColorspaceDetails(scaler_, source, frame.color_range == AVCOL_RANGE_JPEG,
                           sws_getCoefficients(SWS_CS_DEFAULT), 1, 0, 1 << 16, 1 << 16);
  header.kind = DecodeHeader::kFrame;
  header.width = static_cast<std::uint32_t>(frame.width);
  header.height = static_cast<std::uint32_t>(frame.height);
  header.channels = grey ? 1 : 3;
  const std::size_t line = static_cast<std::size_t>(header.width) * header.channels;
  // Vectors of swscale write some bytes beyond the last line.
  pixels_.resize(line * header.height + 64);
  std::uint8_t* planes[] = {pixels_.data()};
  const int strides[] = {static_cast<int>(line)};
  sws_scale(scaler_, frame.data, frame.linesize, 0, frame.height, planes, strides);
  return Send(header, pixels_.data(), line * header.height);
}

}  // namespace saccade
