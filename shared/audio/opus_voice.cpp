#include "shared/audio/opus_voice.hpp"

#include <absl/strings/str_cat.h>
#include <opus.h>

#include <array>

namespace saccade {
namespace {

constexpr int kBitRate_bit_s = 32'000;
constexpr int kExpectedLoss_percent = 5;  // so that a packet can stand in for the one before
constexpr std::size_t kMaxBytes = 400;    // proto: VoicePacket.opus
constexpr int kSilenceBytes = 2;          // Opus' own sign of it

absl::Status Failed(int error) {
  return absl::InternalError(absl::StrCat("Opus: ", opus_strerror(error)));
}

}  // namespace

void OpusVoiceEncoder::Destroy::operator()(OpusEncoder* encoder) const {
  opus_encoder_destroy(encoder);
}

absl::StatusOr<OpusVoiceEncoder> OpusVoiceEncoder::Create() {
  int error = OPUS_OK;
  OpusEncoder* encoder = opus_encoder_create(kVoiceRate_hz, 1, OPUS_APPLICATION_VOIP, &error);
  if (error != OPUS_OK) return Failed(error);
  OpusVoiceEncoder made(encoder);
  opus_encoder_ctl(encoder, OPUS_SET_BITRATE(kBitRate_bit_s));
  opus_encoder_ctl(encoder, OPUS_SET_DTX(1));
  opus_encoder_ctl(encoder, OPUS_SET_INBAND_FEC(1));
  opus_encoder_ctl(encoder, OPUS_SET_PACKET_LOSS_PERC(kExpectedLoss_percent));
  return made;
}

std::string OpusVoiceEncoder::Encode(const VoiceFrame& frame) {
  std::array<unsigned char, kMaxBytes> bytes{};
  const int count =
      opus_encode(encoder_.get(), frame.data(), kVoiceSamples, bytes.data(), bytes.size());
  if (count <= kSilenceBytes) return {};
  return {reinterpret_cast<const char*>(bytes.data()), static_cast<std::size_t>(count)};
}

void OpusVoiceDecoder::Destroy::operator()(OpusDecoder* decoder) const {
  opus_decoder_destroy(decoder);
}

absl::StatusOr<OpusVoiceDecoder> OpusVoiceDecoder::Create() {
  int error = OPUS_OK;
  OpusDecoder* decoder = opus_decoder_create(kVoiceRate_hz, 1, &error);
  if (error != OPUS_OK) return Failed(error);
  return OpusVoiceDecoder(decoder);
}

absl::Status OpusVoiceDecoder::Decode(const std::string& packet, VoiceFrame& frame) {
  const int count = opus_decode(
      decoder_.get(), reinterpret_cast<const unsigned char*>(packet.data()),
      static_cast<opus_int32>(packet.size()), frame.data(), kVoiceSamples, /*decode_fec=*/0);
  if (count == static_cast<int>(kVoiceSamples)) return absl::OkStatus();
  frame.fill(0);
  return absl::InvalidArgumentError(
      count < 0 ? absl::StrCat("Opus: ", opus_strerror(count))
                : absl::StrCat("Opus: a packet of ", count, " samples; 960 (20 ms) are sent"));
}

void OpusVoiceDecoder::Conceal(VoiceFrame& frame) {
  if (opus_decode(decoder_.get(), nullptr, 0, frame.data(), kVoiceSamples, 0) < 0) frame.fill(0);
}

}  // namespace saccade
