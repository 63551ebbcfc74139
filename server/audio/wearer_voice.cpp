#include "server/audio/wearer_voice.hpp"

#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "server/audio/voice_call.hpp"
#include "shared/audio/voice_devices.hpp"
#include "shared/io/log.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kAgain(1000);  // between attempts to join

void SayOnce(std::string& said, const std::string& text) {
  if (std::exchange(said, text) != text) Log(text);
}

void PauseFor(milliseconds duration, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, duration, [] { return false; });
}

std::vector<VoicePacket> FromProto(const v1::VoiceEvent& event) {
  std::vector<VoicePacket> packets;
  for (const v1::VoicePacket& packet : event.packets()) {
    packets.push_back({packet.sequence(), packet.capture_ns(), packet.opus()});
  }
  return packets;
}

}  // namespace

class WearerVoice::Impl {
 public:
  Impl(const WearerVoiceOptions& options, std::shared_ptr<grpc::Channel> channel,
       std::unique_ptr<VoiceDevices> devices)
      : call_(std::move(channel), options.token, options.display_name),
        devices_(std::move(devices)),
        listens_([this](const std::stop_token& stop) { Listen(stop); }),
        sends_([this](const std::stop_token& stop) { Send(stop); }) {}

  ~Impl() {
    listens_.request_stop();
    call_.Cancel();
  }

 private:
  void Listen(const std::stop_token& stop) {
    std::string said;
    while (!stop.stop_requested()) {
      absl::Status status = call_.Join();
      if (status.ok()) {
        said.clear();
        status = call_.Listen([this](const v1::VoiceEvent& event) {
          devices_->mixer().Hear(event.participant_id(), FromProto(event), MonotonicNow());
        });
      }
      devices_->mixer().Clear();
      if (stop.stop_requested()) return;
      SayOnce(said, absl::StrCat("voice: ", status.message(), "; tried again every second"));
      PauseFor(kAgain, stop);
    }
  }

  void Send(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::vector<v1::VoicePacket> packets;
      for (VoicePacket& packet : devices_->Take(stop)) {
        v1::VoicePacket& sent = packets.emplace_back();
        sent.set_sequence(packet.sequence);
        sent.set_capture_ns(packet.capture_ns);  // this machine's clock is the server's
        sent.set_opus(std::move(packet.opus));
      }
      if (!packets.empty()) call_.Send(packets).IgnoreError();  // Listen says what is wrong
    }
  }

  VoiceCall call_;
  const std::unique_ptr<VoiceDevices> devices_;
  std::jthread listens_, sends_;
};

absl::StatusOr<std::unique_ptr<WearerVoice>> WearerVoice::Start(
    const WearerVoiceOptions& options, std::shared_ptr<grpc::Channel> channel) {
  auto devices = VoiceDevices::Start({.capture = options.capture, .playback = options.playback});
  if (!devices.ok()) return devices.status();
  return std::unique_ptr<WearerVoice>(
      new WearerVoice(std::make_unique<Impl>(options, std::move(channel), *std::move(devices))));
}

WearerVoice::WearerVoice(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WearerVoice::~WearerVoice() = default;

}  // namespace saccade
