#include "server/capture/video/packet_loop.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/log.h>
}
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "server/capture/decode_protocol.hpp"
#include "server/capture/video/picture_writer.hpp"

namespace saccade {
namespace {

/// False: the end.
bool ReadAll(void* data, std::size_t size) {
  char* at = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = read(kDecodeFile, at, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

class PacketLoop {
 public:
  explicit PacketLoop(std::int64_t most_pixels) : most_pixels_(most_pixels) {}

  int Run() {
    av_log_set_level(AV_LOG_QUIET);
    packet_ = av_packet_alloc();
    frame_ = av_frame_alloc();
    PacketHeader header;
    while (ReadAll(&header, sizeof header)) {
      if (header.magic != PacketHeader::kMagic || header.size > PacketHeader::kMostBytes) return 1;
      if (av_new_packet(packet_, static_cast<int>(header.size)) != 0) return 1;
      if (!ReadAll(packet_->data, header.size)) return 1;
      packet_->pts = header.time_ns;
      packet_->flags = header.key_frame != 0 ? AV_PKT_FLAG_KEY : 0;
      const bool on = Decode(header);
      av_packet_unref(packet_);
      if (!on) return 1;
    }
    return 0;
  }

 private:
  bool Decode(const PacketHeader& header) {
    if (!Prepare(header)) return false;
    bool answered = false;
    if (avcodec_send_packet(codec_, packet_) < 0) ++bad_;
    while (avcodec_receive_frame(codec_, frame_) == 0) {
      // What cannot be written ends nothing: whoever sends it would have decoders started by it.
      const bool damaged = frame_->decode_error_flags != 0 ||
                           (frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0 ||
                           !writer_.Prepare(*frame_).empty();
      if (damaged) ++bad_;
      DecodeHeader picture;
      picture.time_ns = frame_->pts;
      picture.bad = bad_;
      // One answer each: of two pictures at once the newer one would have to wait.
      if (!damaged && !answered && !writer_.SendFrame(*frame_, picture)) return false;
      answered = answered || !damaged;
      av_frame_unref(frame_);
    }
    if (answered) return true;
    DecodeHeader none;
    none.bad = bad_;
    return Send(none);
  }

  /// The decoder that this packet is for, with nothing of before where it is to begin anew.
  bool Prepare(const PacketHeader& header) {
    if (codec_ != nullptr && of_ == header.codec) {
      if (header.anew != 0) avcodec_flush_buffers(codec_);
      return true;
    }
    avcodec_free_context(&codec_);
    of_ = header.codec;
    const AVCodec* decoder =
        avcodec_find_decoder(of_ == PacketHeader::kVp8 ? AV_CODEC_ID_VP8 : AV_CODEC_ID_H264);
    codec_ = decoder == nullptr ? nullptr : avcodec_alloc_context3(decoder);
    if (codec_ == nullptr) {
      WriteError("there is no decoder for it");
      return false;
    }
    codec_->thread_count = 1;  // the sandbox has no threads
    codec_->flags |= AV_CODEC_FLAG_LOW_DELAY;
    codec_->err_recognition = AV_EF_EXPLODE | AV_EF_BITSTREAM | AV_EF_BUFFER;
    codec_->max_pixels = most_pixels_;
    const int error = avcodec_open2(codec_, decoder, nullptr);
    if (error == 0) return true;
    WriteError("it cannot be decoded: " + AvWords(error));
    return false;
  }

  const std::int64_t most_pixels_;
  AVCodecContext* codec_ = nullptr;
  std::uint32_t of_ = 0;
  AVPacket* packet_ = nullptr;
  AVFrame* frame_ = nullptr;
  PictureWriter writer_;
  std::uint64_t bad_ = 0;
};

}  // namespace

int DecodePackets(std::int64_t most_pixels) {
  // Ends with the process: nothing is worth freeing.
  return (new PacketLoop(most_pixels))->Run();
}

}  // namespace saccade
