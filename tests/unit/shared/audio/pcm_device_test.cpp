#include "shared/audio/pcm_device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace saccade::pcm_device_test {
namespace {

using ::testing::HasSubstr;

TEST(PcmDevice, AWrongNameIsNamedWithARemedy) {
  for (const auto direction : {PcmDevice::Direction::kCapture, PcmDevice::Direction::kPlayback}) {
    const auto device = PcmDevice::Open("no_such_card", direction);
    ASSERT_EQ(device.status().code(), absl::StatusCode::kUnavailable);
    EXPECT_THAT(device.status().message(), HasSubstr("'no_such_card'"));
    EXPECT_THAT(device.status().message(), HasSubstr("arecord -L"));
  }
}

// ALSA's own device of nothing: no card is needed.
TEST(PcmDevice, TwentyMillisecondsAtATime) {
  auto in = PcmDevice::Open("null", PcmDevice::Direction::kCapture);
  auto out = PcmDevice::Open("null", PcmDevice::Direction::kPlayback);
  ASSERT_TRUE(in.ok()) << in.status();
  ASSERT_TRUE(out.ok()) << out.status();
  VoiceFrame frame{};
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(in->Read(frame, std::chrono::seconds(1)).ok());
    EXPECT_TRUE(out->Write(frame, std::chrono::seconds(1)).ok());
  }
}

}  // namespace
}  // namespace saccade::pcm_device_test
