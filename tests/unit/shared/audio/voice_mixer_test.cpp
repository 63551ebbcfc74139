#include "shared/audio/voice_mixer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/shared/audio/tones.hpp"

namespace saccade::voice_mixer_test {
namespace {

using testing::AmplitudeOf;
using testing::Tone;
constexpr Timestamp kFrame = kVoiceFrame_ns;

class Speaker {
 public:
  Speaker(std::string id, double frequency_hz)
      : id_(std::move(id)), tone_(frequency_hz, 6000.0), encoder_(*OpusVoiceEncoder::Create()) {}
  void Say(VoiceMixer& mixer, Timestamp now_ns) {
    mixer.Hear(id_, {{++sequence_, now_ns, encoder_.Encode(tone_.Next())}}, now_ns);
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
    low.Say(mixer, i * kFrame);
    high.Say(mixer, i * kFrame);
    any = mixer.Mix(frame, i * kFrame);
  }
  EXPECT_TRUE(any);
  EXPECT_GT(AmplitudeOf(440.0, frame), 3000.0);
  EXPECT_GT(AmplitudeOf(1320.0, frame), 3000.0);
  EXPECT_THAT(mixer.Speaking(50 * kFrame, 5 * kFrame), ::testing::UnorderedElementsAre("a", "b"));
  EXPECT_THAT(mixer.Speaking(100 * kFrame, 5 * kFrame), ::testing::IsEmpty());
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
    mixer.Hear("bad", {{static_cast<std::uint64_t>(i), 0, std::string(300, '\xff')}}, i * kFrame);
    good.Say(mixer, i * kFrame);
    mixer.Mix(frame, i * kFrame);
  }
  EXPECT_GT(AmplitudeOf(440.0, frame), 4000.0);
}

TEST(VoiceMixer, ThoseWhoCannotAllBeHeardAreBounded) {
  VoiceMixer mixer;
  for (int i = 0; i < 40; ++i) Speaker(std::to_string(i), 440.0).Say(mixer, 0);
  VoiceFrame frame{};
  for (int i = 0; i < 10; ++i) mixer.Mix(frame, i * kFrame);
  // Those before are forgotten: there is room again.
  Speaker late("late", 1320.0);
  bool any = false;
  for (int i = 0; i < 25; ++i) {
    const Timestamp now = 20'000'000'000 + i * kFrame;
    mixer.Mix(frame, now);
    late.Say(mixer, now);
    any = mixer.Mix(frame, now) || any;
  }
  EXPECT_TRUE(any);
}

}  // namespace
}  // namespace saccade::voice_mixer_test
