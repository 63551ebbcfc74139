#include "server/capture/phone/packet_decoder.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "server/capture/image_file.hpp"

namespace saccade {
namespace {

constexpr std::chrono::milliseconds kHangs(1'000);  // for one picture
constexpr std::chrono::milliseconds kStarting(5'000);
constexpr int kPadding_px = 64;  // what decoders add to a side

/// Twice the sides, so that the usual mistakes are still seen and said; beyond, none is decoded.
std::int64_t MostPixels(cv::Size size) {
  return std::int64_t{4} * (size.width + kPadding_px) * (size.height + kPadding_px);
}

}  // namespace

absl::StatusOr<DecodedPacket> PacketDecoder::Decode(const CodedPicture& packet, bool anew) {
  if (packet.data.empty() || packet.data.size() > PacketHeader::kMostBytes) {
    return DecodedPacket{packet.picture_id, {}, true, {}};
  }
  const std::chrono::milliseconds most = process_ == nullptr ? kStarting : kHangs;
  const absl::Status asked = Ask(packet, anew, most);
  absl::StatusOr<DecodedPacket> decoded =
      asked.ok() ? Answer(packet, most) : absl::StatusOr<DecodedPacket>(asked);
  if (!decoded.ok()) {
    process_.reset();
    pid_ = 0;
  }
  return decoded;
}

absl::Status PacketDecoder::Ask(const CodedPicture& packet, bool anew,
                                std::chrono::milliseconds most) {
  if (process_ == nullptr) {
    absl::StatusOr<std::unique_ptr<DecoderProcess>> process =
        DecoderProcess::StartPackets(MostPixels(size_));
    if (!process.ok()) return process.status();
    if (std::exchange(started_, true)) ++restarts_;
    process_ = *std::move(process);
    pid_ = process_->pid();
    bad_of_process_ = 0;
  }
  PacketHeader header;
  header.codec = packet.codec;
  header.key_frame = packet.key_frame ? 1 : 0;
  header.anew = anew ? 1 : 0;
  header.size = static_cast<std::uint32_t>(packet.data.size());
  header.time_ns = static_cast<std::int64_t>(packet.picture_id);
  const absl::Status head = process_->Write(&header, sizeof header, stopped_, most);
  if (!head.ok()) return head;
  return process_->Write(packet.data.data(), packet.data.size(), stopped_, most);
}

absl::StatusOr<DecodedPacket> PacketDecoder::Answer(const CodedPicture& packet,
                                                    std::chrono::milliseconds most) {
  const absl::StatusOr<DecodeHeader> header = process_->ReadHeader(stopped_, most);
  if (!header.ok()) return header.status();
  DecodedPacket decoded{packet.picture_id, {}, header->bad > bad_of_process_, {}};
  bad_of_process_ = header->bad;
  if (header->kind == DecodeHeader::kAlive) return decoded;
  if (header->kind == DecodeHeader::kError) {
    const absl::StatusOr<std::string> text = process_->ReadText(*header, stopped_);
    return text.ok() ? absl::UnavailableError(*text) : text.status();
  }
  const bool colour = header->channels == 3;
  const bool fits = header->kind == DecodeHeader::kFrame && header->width <= kMaxPictureSide_px &&
                    header->height <= kMaxPictureSide_px && (colour || header->channels == 1) &&
                    header->size == std::size_t{header->width} * header->height * header->channels;
  const cv::Size came(static_cast<int>(header->width), static_cast<int>(header->height));
  if (!fits || std::int64_t{came.width} * came.height > MostPixels(size_)) {
    return absl::UnavailableError("the decoder writes nonsense");
  }
  if (came != size_ && came != cv::Size(size_.height, size_.width)) {
    const absl::Status skipped = process_->SkipBytes(header->size, stopped_);
    if (!skipped.ok()) return skipped;
    decoded.refused = came;
    return decoded;
  }
  try {
    decoded.pixels.create(came, colour ? CV_8UC3 : CV_8UC1);
  } catch (const std::exception&) {
    return absl::ResourceExhaustedError("there is no memory for a picture");
  }
  decoded.picture_id = static_cast<std::uint64_t>(header->time_ns);
  const absl::Status read = process_->ReadBytes(decoded.pixels.data, header->size, stopped_);
  if (!read.ok()) return read;
  return decoded;
}

}  // namespace saccade
