#include "shared/audio/echo_canceller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace saccade::echo_canceller_test {
namespace {

double Power(const VoiceFrame& frame) {
  double sum = 0.0;
  for (const std::int16_t sample : frame) sum += static_cast<double>(sample) * sample;
  return sum / kVoiceSamples;
}

// What a loudspeaker says comes back at the microphone 15 ms later and quieter.
TEST(EchoCanceller, TakesOutWhatTheLoudspeakerSays) {
  EchoCanceller canceller;
  std::mt19937 random(3);
  std::normal_distribution<double> voice(0.0, 3000.0);
  VoiceFrame before{};
  double echo = 0.0, left = 0.0;
  for (int i = 0; i < 400; ++i) {
    VoiceFrame played;
    double low = 0.0;  // loud and quiet by turns, as speech is
    const double loud = (i / 10) % 2 == 0 ? 1.0 : 0.2;
    for (std::int16_t& sample : played) {
      low = 0.7 * low + 0.3 * voice(random);
      sample = static_cast<std::int16_t>(loud * low);
    }
    constexpr std::size_t kDelay = 720;
    VoiceFrame heard;
    for (std::size_t k = 0; k < kVoiceSamples; ++k) {
      const std::int16_t source =
          k < kDelay ? before[kVoiceSamples - kDelay + k] : played[k - kDelay];
      heard[k] = static_cast<std::int16_t>(source / 2);
    }
    canceller.Played(played);
    const VoiceFrame clean = canceller.Captured(heard);
    before = played;
    if (i < 300) continue;  // it learns
    echo += Power(heard);
    left += Power(clean);
  }
  EXPECT_LT(10.0 * std::log10(left / echo), -15.0);
}

}  // namespace
}  // namespace saccade::echo_canceller_test
