#include "server/capture/video/decoder.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
}
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "server/capture/decode_protocol.hpp"
#include "server/capture/video/picture_writer.hpp"

namespace saccade {
namespace {

constexpr int kReadBytes = 1 << 16;
constexpr int kAliveEvery = 10;  // frames that are skipped
constexpr AVRational kNanoseconds{1, 1'000'000'000};
// Containers of pictures; none that names other files (playlists, concatenations).
constexpr char kFormats[] =
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,h264,hevc,ivf,ogg,flv,mjpeg,asf,rtsp,"
    "rtp,sdp";

/// What the file says of how the camera was held, as telephones do: a quarter turn, or none.
std::uint32_t ClockwiseOf(const AVStream& stream) {
  const std::uint8_t* matrix = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (matrix == nullptr) return 0;
  const double turn = -av_display_rotation_get(reinterpret_cast<const std::int32_t*>(matrix));
  if (!std::isfinite(turn)) return 0;
  return static_cast<std::uint32_t>(std::lround(turn / 90) % 4 + 4) % 4 * 90;
}

int ReadInput(void*, std::uint8_t* buffer, int size) {
  const ssize_t got = read(kDecodeFile, buffer, static_cast<std::size_t>(size));
  if (got == 0) return AVERROR_EOF;
  return got < 0 ? AVERROR(errno) : static_cast<int>(got);
}

std::int64_t SeekInput(void*, std::int64_t offset, int whence) {
  if ((whence & AVSEEK_SIZE) != 0) {
    const off_t here = lseek(kDecodeFile, 0, SEEK_CUR);
    const off_t end = lseek(kDecodeFile, 0, SEEK_END);
    lseek(kDecodeFile, here, SEEK_SET);
    return end;
  }
  return lseek(kDecodeFile, offset, whence & ~AVSEEK_FORCE);
}

class Decoder {
 public:
  explicit Decoder(const DecodeRequest& request) : request_(request) {}

  int Run() {
    if (!Open()) return 1;
    if (request_.after_ns >= 0 && request_.url.empty()) Seek();
    AVPacket* packet = av_packet_alloc();
    for (int read = 0; read >= 0;) {
      read = av_read_frame(format_, packet);
      if (read == AVERROR(EAGAIN)) {
        read = 0;
        continue;
      }
      const bool ours = read >= 0 && packet->stream_index == stream_->index;
      if (read < 0 || ours) {
        const int sent = avcodec_send_packet(codec_, read < 0 ? nullptr : packet);
        if (sent < 0 && sent != AVERROR_EOF) ++bad_;
        if (!Drain()) return 1;
      }
      if (read >= 0) av_packet_unref(packet);
      if (read < 0 && read != AVERROR_EOF && !request_.url.empty()) {
        WriteError("the stream broke off: " + AvWords(read));
        return 1;
      }
    }
    DecodeHeader end;
    end.kind = DecodeHeader::kEnd;
    end.bad = bad_;
    return Send(end) ? 0 : 1;
  }

 private:
  bool Fail(const std::string& why) {
    WriteError(why);
    return false;
  }

  bool Open() {
    av_log_set_level(AV_LOG_QUIET);
    format_ = avformat_alloc_context();
    AVDictionary* options = nullptr;
    av_dict_set(&options, "format_whitelist", kFormats, 0);
    if (request_.url.empty()) {
      auto* buffer = static_cast<unsigned char*>(av_malloc(kReadBytes));
      format_->pb =
          avio_alloc_context(buffer, kReadBytes, 0, nullptr, ReadInput, nullptr, SeekInput);
    } else {
      avformat_network_init();
      av_dict_set(&options, "rtsp_transport", "tcp", 0);  // complete pictures, and one connection
      av_dict_set(&options, "stimeout", "3000000", 0);    // us
      av_dict_set(&options, "timeout", "3000000", 0);
      av_dict_set(&options, "fflags", "nobuffer", 0);
      av_dict_set(&options, "protocol_whitelist", "rtsp,rtp,udp,tcp", 0);
    }
    const char* url = request_.url.empty() ? nullptr : request_.url.c_str();
    int error = avformat_open_input(&format_, url, nullptr, &options);
    av_dict_free(&options);
    if (error < 0) return Fail(OpenWords(error));
    error = avformat_find_stream_info(format_, nullptr);
    if (error < 0) return Fail("its streams cannot be read: " + AvWords(error));
    const AVCodec* decoder = nullptr;
    const int index = av_find_best_stream(format_, AVMEDIA_TYPE_VIDEO, -1, -1, &decoder, 0);
    if (index < 0) return Fail("it holds no video that can be decoded");
    stream_ = format_->streams[index];
    return OpenCodec(decoder);
  }

  std::string OpenWords(int error) const {
    if (!request_.url.empty()) {
      return "it cannot be opened (" + AvWords(error) + "); is it on, and is the address right?";
    }
    return "it is no video that is read here (" + AvWords(error) +
           "); convert it, for example: ffmpeg -i IN -c:v libx264 -an OUT.mp4";
  }

  bool OpenCodec(const AVCodec* decoder) {
    codec_ = avcodec_alloc_context3(decoder);
    avcodec_parameters_to_context(codec_, stream_->codecpar);
    codec_->thread_count = 1;  // the sandbox has no threads
    codec_->max_pixels = std::int64_t{1} << 25;
    const int error = avcodec_open2(codec_, decoder, nullptr);
    if (error < 0) return Fail("its video cannot be decoded: " + AvWords(error));
    DecodeHeader info;
    info.kind = DecodeHeader::kInfo;
    info.width = static_cast<std::uint32_t>(codec_->width);
    info.height = static_cast<std::uint32_t>(codec_->height);
    const AVRational rate = av_guess_frame_rate(format_, stream_, nullptr);
    if (rate.num > 0 && rate.den > 0) info.fps = av_q2d(rate);
    info.clockwise_deg = ClockwiseOf(*stream_);
    frame_ns_ = static_cast<std::int64_t>(1e9 / (info.fps > 0 ? info.fps : 30.0));
    return SendText(info, decoder->name);
  }

  void Seek() {
    const std::int64_t begin = stream_->start_time == AV_NOPTS_VALUE ? 0 : stream_->start_time;
    const std::int64_t at =
        begin + av_rescale_q(request_.after_ns, kNanoseconds, stream_->time_base);
    if (av_seek_frame(format_, stream_->index, at, AVSEEK_FLAG_BACKWARD) < 0) {
      av_seek_frame(format_, stream_->index, begin, AVSEEK_FLAG_BACKWARD);
    }
  }

  /// Every frame that is ready. False: as SendFrame.
  bool Drain() {
    AVFrame* frame = av_frame_alloc();
    bool read = true;
    while (read) {
      const int got = avcodec_receive_frame(codec_, frame);
      if (got == AVERROR(EAGAIN) || got == AVERROR_EOF) break;
      if (got < 0) {
        ++bad_;
        break;
      }
      if (frame->decode_error_flags != 0 || (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0) {
        ++bad_;
      } else {
        read = SendFrame(*frame);
      }
      av_frame_unref(frame);
    }
    av_frame_free(&frame);
    return read;
  }

  std::int64_t TimeOf(const AVFrame& frame) {
    std::int64_t time_ns = last_ns_ + frame_ns_;
    if (frame.best_effort_timestamp != AV_NOPTS_VALUE) {
      const std::int64_t begin = stream_->start_time == AV_NOPTS_VALUE ? 0 : stream_->start_time;
      time_ns = av_rescale_q(frame.best_effort_timestamp - begin, stream_->time_base, kNanoseconds);
    } else if (last_ns_ < 0) {
      time_ns = 0;
    }
    return time_ns;
  }

  /// False: nobody reads any more, or it cannot be written and that was said.
  bool SendFrame(const AVFrame& frame) {
    const std::int64_t time_ns = TimeOf(frame);
    if (time_ns <= last_ns_) {  // no time goes backwards
      ++bad_;
      return true;
    }
    last_ns_ = time_ns;
    DecodeHeader header;
    if (time_ns <= request_.after_ns) {
      return ++skipped_ % kAliveEvery != 0 || Send(header);
    }
    header.time_ns = time_ns;
    header.bad = bad_;
    const std::string refusal = writer_.Prepare(frame);
    if (refusal.empty()) return writer_.SendFrame(frame, header);
    WriteError(refusal);
    return false;
  }

  const DecodeRequest request_;
  AVFormatContext* format_ = nullptr;
  AVStream* stream_ = nullptr;
  AVCodecContext* codec_ = nullptr;
  PictureWriter writer_;
  std::int64_t last_ns_ = -1, frame_ns_ = 0;
  std::uint64_t bad_ = 0, skipped_ = 0;
};

}  // namespace

int DecodeVideo(const DecodeRequest& request) {
  // Ends with the process: nothing is worth freeing.
  return (new Decoder(request))->Run();
}

}  // namespace saccade
