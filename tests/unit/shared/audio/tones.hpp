#pragma once

#include <cmath>
#include <numbers>
#include <span>

#include "shared/audio/voice_frame.hpp"

namespace saccade::testing {

/// A sine of `amplitude` that goes on from one frame to the next.
class Tone {
 public:
  Tone(double frequency_hz, double amplitude)
      : frequency_hz_(frequency_hz), amplitude_(amplitude) {}

  VoiceFrame Next() {
    VoiceFrame frame;
    for (std::int16_t& sample : frame) {
      const double angle = 2.0 * std::numbers::pi * frequency_hz_ * sample_++ / kVoiceRate_hz;
      sample = static_cast<std::int16_t>(std::lround(amplitude_ * std::sin(angle)));
    }
    return frame;
  }

 private:
  double frequency_hz_, amplitude_;
  std::int64_t sample_ = 0;
};

/// How much of that frequency is in the samples (amplitude).
inline double AmplitudeOf(double frequency_hz, std::span<const std::int16_t> samples) {
  double real = 0.0, imaginary = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double angle =
        2.0 * std::numbers::pi * frequency_hz * static_cast<double>(i) / kVoiceRate_hz;
    real += samples[i] * std::cos(angle);
    imaginary += samples[i] * std::sin(angle);
  }
  return 2.0 * std::hypot(real, imaginary) / static_cast<double>(samples.size());
}

}  // namespace saccade::testing
