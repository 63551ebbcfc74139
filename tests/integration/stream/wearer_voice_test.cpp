// Voice of a wearable without a browser, and of the desktop client: libasound against a sound
// server of the test's own, whose microphone hears 440 Hz and whose loudspeaker is recorded.
#include "server/audio/wearer_voice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <thread>

#include "client/session/session.hpp"
#include "client/talk/voice_room.hpp"
#include "saccade/v1/talk.grpc.pb.h"
#include "shared/audio/opus_voice.hpp"
#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"
#include "tests/integration/support/process.hpp"
#include "tests/unit/shared/audio/tones.hpp"

namespace saccade::wearer_voice_test {
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

  /// Whether the loudspeaker says that tone, within a while.
  static bool Says(double frequency_hz) {
    bool heard = false;
    for (int tries = 0; tries < 5 && !heard; ++tries) {
      const std::vector<std::int16_t> said = Listen(3);
      for (std::size_t at = 0; at + 4800 <= said.size(); at += 4800) {
        heard |= AmplitudeOf(frequency_hz, std::span(said).subspan(at, 4800)) > 4000.0;
      }
    }
    return heard;
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

/// Somebody who says a tone all the time.
class ToneSpeaker {
 public:
  explicit ToneSpeaker(const std::string& address) : client_(address) {
    thread_ = std::jthread([this, address](const std::stop_token& stop) { Speak(stop, address); });
  }
  const std::string& participant_id() const { return client_.participant_id(); }

 private:
  void Speak(const std::stop_token& stop, const std::string& address) {
    const auto talk =
        v1::TalkService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
    auto encoder = OpusVoiceEncoder::Create();
    testing::Tone tone(kExpert_hz, 8000.0);
    auto next = std::chrono::steady_clock::now();
    for (std::uint64_t i = 1; !stop.stop_requested(); ++i) {
      v1::SpeakRequest request;
      request.set_session_id(client_.session_id());
      v1::VoicePacket& packet = *request.add_packets();
      packet.set_sequence(i);
      packet.set_opus(encoder->Encode(tone.Next()));
      grpc::ClientContext context;
      v1::SpeakResponse response;
      if (!packet.opus().empty()) talk->Speak(&context, request, &response);
      std::this_thread::sleep_until(next += 20ms);
    }
  }
  TestClient client_;
  std::jthread thread_;
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
  const ToneSpeaker expert(server.address());
  EXPECT_TRUE(Says(kExpert_hz));
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

struct NoPictures : session::PictureSink {
  void Reset() override {}
  void Push(net::CodedPicture /*picture*/) override {}
  bool TakeKeyFrameRequest() override { return false; }
  bool Behind() const override { return false; }
};

/// The desktop client's session and room, polled as the window does.
class Desktop {
 public:
  Desktop(const std::string& address, talk::VoiceOptions options)
      : room_(std::move(options), [] {}), session_(OptionsFor(address), pictures_, [] {}) {}
  ~Desktop() { room_.End(session_); }

  template <typename Condition>
  bool Until(Condition condition, std::chrono::milliseconds limit = 20s) {
    for (const auto end = std::chrono::steady_clock::now() + limit;
         std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(5ms)) {
      session_.Poll();
      room_.Check(session_, MonotonicNow());
      if (condition()) return true;
    }
    return false;
  }
  bool Join() {
    if (!Until([this] { return session_.state().link.live(); })) return false;
    room_.Join(session_);
    return Until([this] { return room_.state() == talk::VoiceRoom::State::kOn; });
  }
  talk::VoiceRoom& room() { return room_; }
  session::Session& session() { return session_; }

 private:
  session::SessionOptions OptionsFor(const std::string& address) {
    session::SessionOptions options;
    options.connection.server = address;
    options.on_voice = [this](const net::VoiceNews& news) { room_.Hear(news); };
    return options;
  }
  NoPictures pictures_;
  talk::VoiceRoom room_;
  session::Session session_;
};

TEST_F(WearerVoiceTest, TheDesktopHearsAndLightsUpWhoSpeaks) {
  InProcessServer server;
  const ToneSpeaker expert(server.address());
  Desktop desktop(server.address(), {.microphone = "", .loudspeaker = "pulse"});
  ASSERT_TRUE(desktop.Join()) << desktop.room().problem();
  EXPECT_EQ(desktop.room().Words(), "You hear the others.");
  EXPECT_TRUE(desktop.Until([&] { return desktop.room().Speaks(expert.participant_id()); }));
  const auto listens = [&] {
    const session::State& told = desktop.session().state();
    return ::testing::Value(told.listeners, ::testing::Contains(told.joined.participant_id));
  };
  EXPECT_TRUE(desktop.Until(listens)) << "the others see that one hears";
  EXPECT_TRUE(Says(kExpert_hz));
  desktop.room().Leave(desktop.session());
  EXPECT_TRUE(desktop.Until([&] { return !listens(); }));
}

TEST_F(WearerVoiceTest, TheDesktopIsHeardUnlessMutedAndWithPushToTalkWhileHeld) {
  InProcessServer server;
  TestClient expert(server.address());
  expert.Subscribe(VoiceOnly());
  const auto packets = [&expert] {
    std::size_t count = 0;
    for (const ReceivedEvent& one : expert.events()) count += one.event.voice().packets_size();
    return count;
  };
  // No loudspeaker: beside one a steady tone is taken out as noise.
  Desktop desktop(server.address(), {.microphone = "pulse", .loudspeaker = ""});
  ASSERT_TRUE(desktop.Join()) << desktop.room().problem();
  const auto more = [&](std::chrono::milliseconds within) {
    const std::size_t before = packets();
    return desktop.Until([&] { return packets() >= before + 10; }, within);
  };
  const auto silent = [&] {
    more(500ms);  // what is under way
    return !more(1000ms);
  };
  EXPECT_TRUE(more(20s));
  const auto& own = desktop.session().state().joined.participant_id;
  EXPECT_TRUE(desktop.Until([&] { return desktop.room().Speaks(own); }));
  desktop.room().ToggleMute();
  EXPECT_TRUE(silent());
  EXPECT_EQ(desktop.room().Words(), "You are muted.");
  desktop.room().ToggleMute();
  desktop.room().TogglePushToTalk();
  EXPECT_TRUE(silent());
  desktop.room().Press(true);
  EXPECT_TRUE(more(20s)) << desktop.room().problem();
  desktop.room().Press(false);
  EXPECT_TRUE(silent());
}

TEST_F(WearerVoiceTest, TheDesktopHearsWithoutAMicrophoneAndSaysWhatIsMissing) {
  InProcessServer server;
  Desktop desktop(server.address(), {.microphone = "no-such-device", .loudspeaker = "pulse"});
  ASSERT_TRUE(desktop.Join());
  EXPECT_FALSE(desktop.room().has_microphone());
  EXPECT_THAT(desktop.room().problem(), ::testing::HasSubstr("no-such-device"));
  Desktop deaf(server.address(), {.microphone = "", .loudspeaker = "no-such-device"});
  ASSERT_TRUE(deaf.Until([&] { return deaf.session().state().link.live(); }));
  deaf.room().Join(deaf.session());
  EXPECT_TRUE(deaf.Until([&] { return deaf.room().state() == talk::VoiceRoom::State::kOff; }));
  EXPECT_THAT(deaf.room().problem(), ::testing::HasSubstr("No sound"));
}

}  // namespace
}  // namespace saccade::wearer_voice_test
