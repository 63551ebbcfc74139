#include "shared/audio/opus_voice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/shared/audio/tones.hpp"

namespace saccade::opus_voice_test {
namespace {

using testing::AmplitudeOf;
using testing::Tone;

TEST(OpusVoice, AToneComesBackAtItsPitchAndLevel) {
  auto encoder = OpusVoiceEncoder::Create();
  auto decoder = OpusVoiceDecoder::Create();
  ASSERT_TRUE(encoder.ok() && decoder.ok());
  Tone tone(440.0, 8000.0);
  VoiceFrame heard{};
  for (int i = 0; i < 25; ++i) {
    const std::string packet = encoder->Encode(tone.Next());
    ASSERT_FALSE(packet.empty());
    EXPECT_LE(packet.size(), 400u);
    ASSERT_TRUE(decoder->Decode(packet, heard).ok());
  }
  EXPECT_NEAR(AmplitudeOf(440.0, heard), 8000.0, 1600.0);
  EXPECT_LT(AmplitudeOf(1500.0, heard), 400.0);
}

TEST(OpusVoice, SilenceIsNotSent) {
  auto encoder = OpusVoiceEncoder::Create();
  ASSERT_TRUE(encoder.ok());
  int sent = 0;
  for (int i = 0; i < 100; ++i) sent += !encoder->Encode(VoiceFrame{}).empty();
  EXPECT_LT(sent, 30);
}

TEST(OpusVoice, WhatIsNoOpusIsRefusedAndTheNextPacketIsHeard) {
  auto encoder = OpusVoiceEncoder::Create();
  auto decoder = OpusVoiceDecoder::Create();
  ASSERT_TRUE(encoder.ok() && decoder.ok());
  Tone tone(440.0, 8000.0);
  VoiceFrame heard{};
  heard.fill(7);
  EXPECT_TRUE(absl::IsInvalidArgument(decoder->Decode(std::string(300, '\xff'), heard)));
  EXPECT_THAT(heard, ::testing::Each(0));
  for (int i = 0; i < 10; ++i)
    ASSERT_TRUE(decoder->Decode(encoder->Encode(tone.Next()), heard).ok());
  EXPECT_GT(AmplitudeOf(440.0, heard), 6000.0);
}

TEST(OpusVoice, WhatIsMissingGoesOnForAMomentAndFades) {
  auto encoder = OpusVoiceEncoder::Create();
  auto decoder = OpusVoiceDecoder::Create();
  ASSERT_TRUE(encoder.ok() && decoder.ok());
  Tone tone(440.0, 8000.0);
  VoiceFrame heard{};
  for (int i = 0; i < 25; ++i)
    ASSERT_TRUE(decoder->Decode(encoder->Encode(tone.Next()), heard).ok());
  decoder->Conceal(heard);
  EXPECT_GT(AmplitudeOf(440.0, heard), 3000.0);
  for (int i = 0; i < 50; ++i) decoder->Conceal(heard);
  EXPECT_LT(AmplitudeOf(440.0, heard), 1000.0);
}

}  // namespace
}  // namespace saccade::opus_voice_test
