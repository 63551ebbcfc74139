// Voice of a wearable without a browser: libasound against a sound server of the test's own, whose
// microphone hears 440 Hz and whose loudspeaker is recorded.
#include "server/audio/wearer_voice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <thread>

#include "saccade/v1/talk.grpc.pb.h"
#include "server/audio/opus_voice.hpp"
#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"
#include "tests/integration/support/process.hpp"
#include "tests/unit/server/audio/tones.hpp"

namespace saccade {
namespace {

using namespace std::chrono_literals;
using testing::AmplitudeOf;
using testing::InProcessServer;
using testing::Process;
using testing::ReceivedEvent;
using testing::TestClient;

constexpr double kMicrophone_hz = 440.0, kExpert_hz = 1320.0;
constexpr const char* kPulse = "/usr/bin/pulseaudio";

class WearerVoiceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (::access(kPulse, X_OK) != 0) GTEST_SKIP() << "pulseaudio is not installed";
    const std::string socket = folder_ / "native";
    setenv("PULSE_SERVER", ("unix:" + socket).c_str(), 1);
    setenv("PULSE_SINK", "ear", 1);
    setenv("PULSE_SOURCE", "mouth", 1);
    setenv("PULSE_COOKIE", (folder_ / "cookie").c_str(), 1);
    pulse_.emplace(
        std::vector<std::string>{kPulse, "-n", "--daemonize=no", "--use-pid-file=no",
                                 "--exit-idle-time=-1", "--disallow-exit", "-L",
                                 "module-native-protocol-unix auth-anonymous=1 socket=" + socket,
                                 "-L", "module-null-sink sink_name=ear", "-L",
                                 "module-sine-source source_name=mouth frequency=440"},
        std::vector<std::string>{"HOME=" + folder_.path(), "XDG_RUNTIME_DIR=" + folder_.path()});
    for (int i = 0; i < 100 && !Running(); ++i) std::this_thread::sleep_for(100ms);
    ASSERT_TRUE(Running()) << pulse_->err();
  }

  static bool Running() { return testing::RunProgram({"/usr/bin/pactl", "info"}).exit_code == 0; }

  /// What the loudspeaker said during `seconds`.
  static std::vector<std::int16_t> Listen(int seconds) {
    const auto result = testing::RunProgram(
        {"/usr/bin/timeout", std::to_string(seconds), "/usr/bin/parec", "--device=ear.monitor",
         "--format=s16le", "--rate=48000", "--channels=1", "--raw"});
    std::vector<std::int16_t> samples(result.out.size() / 2);
    std::memcpy(samples.data(), result.out.data(), 2 * samples.size());
    return samples;
  }

  static std::unique_ptr<WearerVoice> Start(InProcessServer& server, const std::string& in,
                                            const std::string& out) {
    auto voice = WearerVoice::Start({.capture = in, .playback = out, .token = ""},
                                    server.rpc().InProcessChannel());
    EXPECT_TRUE(voice.ok()) << voice.status();
    return *std::move(voice);
  }

  testing::TemporaryFolder folder_;
  std::optional<Process> pulse_;
};

v1::SubscribeRequest VoiceOnly() {
  v1::SubscribeRequest request;
  request.add_topics(v1::TOPIC_VOICE);
  return request;
}

TEST_F(WearerVoiceTest, TheExpertHearsTheMicrophone) {
  InProcessServer server;
  TestClient expert(server.address());
  expert.Subscribe(VoiceOnly());
  const auto voice = Start(server, "pulse", "");
  const auto packets = [](const std::vector<ReceivedEvent>& events) {
    std::vector<v1::VoicePacket> all;
    for (const ReceivedEvent& one : events) {
      for (const v1::VoicePacket& packet : one.event.voice().packets()) all.push_back(packet);
    }
    return all;
  };
  ASSERT_TRUE(expert.WaitFor(
      [&](const std::vector<ReceivedEvent>& events) { return packets(events).size() >= 50; }, 20s));
  auto decoder = OpusVoiceDecoder::Create();
  ASSERT_TRUE(decoder.ok());
  std::vector<std::int16_t> heard;
  std::uint64_t last = 0;
  for (const v1::VoicePacket& packet : packets(expert.events())) {
    VoiceFrame frame;
    ASSERT_TRUE(decoder->Decode(packet.opus(), frame).ok());
    heard.insert(heard.end(), frame.begin(), frame.end());
    EXPECT_GT(packet.sequence(), last);
    last = packet.sequence();
  }
  const std::span<const std::int16_t> settled = std::span(heard).subspan(heard.size() / 2);
  EXPECT_GT(AmplitudeOf(kMicrophone_hz, settled.first(4800)), 1000.0);
  EXPECT_LT(AmplitudeOf(kExpert_hz, settled.first(4800)), 300.0);
}

TEST_F(WearerVoiceTest, TheLoudspeakerSaysWhatTheExpertSays) {
  InProcessServer server;
  const auto voice = Start(server, "", "pulse");
  TestClient expert(server.address());
  const auto talk = v1::TalkService::NewStub(
      grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials()));
  std::jthread speaker([&](const std::stop_token& stop) {
    auto encoder = OpusVoiceEncoder::Create();
    testing::Tone tone(kExpert_hz, 8000.0);
    auto next = std::chrono::steady_clock::now();
    for (std::uint64_t i = 1; !stop.stop_requested(); ++i) {
      v1::SpeakRequest request;
      request.set_session_id(expert.session_id());
      v1::VoicePacket& packet = *request.add_packets();
      packet.set_sequence(i);
      packet.set_opus(encoder->Encode(tone.Next()));
      grpc::ClientContext context;
      v1::SpeakResponse response;
      if (!packet.opus().empty()) talk->Speak(&context, request, &response);
      std::this_thread::sleep_until(next += 20ms);
    }
  });
  bool heard = false;
  for (int tries = 0; tries < 5 && !heard; ++tries) {
    const std::vector<std::int16_t> said = Listen(3);
    for (std::size_t at = 0; at + 4800 <= said.size(); at += 4800) {
      heard |= AmplitudeOf(kExpert_hz, std::span(said).subspan(at, 4800)) > 4000.0;
    }
  }
  EXPECT_TRUE(heard);
}

TEST_F(WearerVoiceTest, EndsAtOnceWhenTheSoundServerIsGone) {
  InProcessServer server;
  auto voice = Start(server, "pulse", "pulse");
  std::this_thread::sleep_for(300ms);
  pulse_->Signal(SIGKILL);
  std::this_thread::sleep_for(500ms);
  const auto begin = std::chrono::steady_clock::now();
  voice.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
}

}  // namespace
}  // namespace saccade
