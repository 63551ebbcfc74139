#include "server/audio/voice_mixer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/audio/tones.hpp"

namespace saccade {
namespace {

using testing::AmplitudeOf;
using testing::Tone;
constexpr Timestamp kFrame = kVoiceFrame_ns;

class Speaker {
 public:
  Speaker(std::string id, double frequency_hz)
      : id_(std::move(id)), tone_(frequency_hz, 6000.0), encoder_(*OpusVoiceEncoder::Create()) {}
  v1::VoiceEvent Next() {
    v1::VoiceEvent event;
    event.set_participant_id(id_);
    v1::VoicePacket& packet = *event.add_packets();
    packet.set_sequence(++sequence_);
    packet.set_opus(encoder_.Encode(tone_.Next()));
    return event;
  }

 private:
  std::string id_;
  Tone tone_;
  OpusVoiceEncoder encoder_;
  std::uint64_t sequence_ = 0;
};

TEST(VoiceMixer, TwoAtOnceAreBothHeard) {
  VoiceMixer mixer;
  Speaker low("a", 440.0), high("b", 1320.0);
  VoiceFrame frame{};
  bool any = false;
  for (int i = 0; i < 50; ++i) {
    mixer.Hear(low.Next(), i * kFrame);
    mixer.Hear(high.Next(), i * kFrame);
    any = mixer.Mix(frame, i * kFrame);
  }
  EXPECT_TRUE(any);
  EXPECT_GT(AmplitudeOf(440.0, frame), 3000.0);
  EXPECT_GT(AmplitudeOf(1320.0, frame), 3000.0);
}

TEST(VoiceMixer, NobodyIsSilence) {
  VoiceMixer mixer;
  VoiceFrame frame;
  frame.fill(99);
  EXPECT_FALSE(mixer.Mix(frame, 0));
  EXPECT_THAT(frame, ::testing::Each(0));
}

TEST(VoiceMixer, WhatIsNoOpusIsNotHeardAndDisturbsNobody) {
  VoiceMixer mixer;
  Speaker good("good", 440.0);
  VoiceFrame frame{};
  for (int i = 0; i < 50; ++i) {
    v1::VoiceEvent bad;
    bad.set_participant_id("bad");
    v1::VoicePacket& packet = *bad.add_packets();
    packet.set_sequence(static_cast<std::uint64_t>(i));
    packet.set_opus(std::string(300, '\xff'));
    mixer.Hear(bad, i * kFrame);
    mixer.Hear(good.Next(), i * kFrame);
    mixer.Mix(frame, i * kFrame);
  }
  EXPECT_GT(AmplitudeOf(440.0, frame), 4000.0);
}

TEST(VoiceMixer, ThoseWhoCannotAllBeHeardAreBounded) {
  VoiceMixer mixer;
  for (int i = 0; i < 40; ++i) mixer.Hear(Speaker(std::to_string(i), 440.0).Next(), 0);
  VoiceFrame frame{};
  for (int i = 0; i < 10; ++i) mixer.Mix(frame, i * kFrame);
  // Those before are forgotten: there is room again.
  Speaker late("late", 1320.0);
  bool any = false;
  for (int i = 0; i < 25; ++i) {
    const Timestamp now = 20'000'000'000 + i * kFrame;
    mixer.Mix(frame, now);
    mixer.Hear(late.Next(), now);
    any = mixer.Mix(frame, now) || any;
  }
  EXPECT_TRUE(any);
}

}  // namespace
}  // namespace saccade
