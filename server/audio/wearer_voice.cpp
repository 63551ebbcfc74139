#include "server/audio/wearer_voice.hpp"

#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "server/audio/echo_canceller.hpp"
#include "server/audio/opus_voice.hpp"
#include "server/audio/pcm_device.hpp"
#include "server/audio/voice_call.hpp"
#include "server/audio/voice_mixer.hpp"
#include "shared/io/log.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kMove(200);    // how soon a thread at a silent device sees that it is to end
constexpr int kLateInARow = 10;       // a busy machine misses some
constexpr milliseconds kStuck(300);   // a device that holds its thread longer keeps it
constexpr milliseconds kAgain(1000);  // between attempts to open, and to join
constexpr std::size_t kMostWaiting = 25;  // proto: SpeakRequest.packets

void SayOnce(std::string& said, const std::string& text) {
  if (std::exchange(said, text) != text) Log(text);
}

void PauseFor(milliseconds duration, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, duration, [] { return false; });
}

/// What the devices' threads share; outlives those that are stuck.
class Devices {
 public:
  Devices(WearerVoiceOptions options, OpusVoiceEncoder encoder)
      : options_(std::move(options)), encoder_(std::move(encoder)) {
    if (!options_.capture.empty() && !options_.playback.empty()) echo_.emplace();
  }

  VoiceMixer& mixer() { return mixer_; }

  /// What was captured since; empty: told to stop.
  std::vector<v1::VoicePacket> Take(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    some_.wait(lock, stop, [this] { return !waiting_.empty(); });
    std::vector<v1::VoicePacket> packets(waiting_.begin(), waiting_.end());
    waiting_.clear();
    return packets;
  }

  void Capture(const std::stop_token& stop, std::optional<PcmDevice> device) {
    Health health;
    for (std::uint64_t sequence = 0; !stop.stop_requested();) {
      if (!Ready(stop, options_.capture, PcmDevice::Direction::kCapture, device)) continue;
      VoiceFrame frame;
      if (!Good(device->Read(frame, kMove), health, device)) continue;
      ++sequence;
      v1::VoicePacket packet;
      packet.set_opus(encoder_.Encode(echo_ ? echo_->Captured(frame) : frame));
      if (packet.opus().empty()) continue;
      packet.set_sequence(sequence);
      packet.set_capture_ns(MonotonicNow() - kVoiceFrame_ns);
      const std::lock_guard lock(mutex_);
      waiting_.push_back(std::move(packet));
      if (waiting_.size() > kMostWaiting) waiting_.pop_front();  // too old to be heard
      some_.notify_one();
    }
  }

  void Play(const std::stop_token& stop, std::optional<PcmDevice> device) {
    Health health;
    while (!stop.stop_requested()) {
      if (!Ready(stop, options_.playback, PcmDevice::Direction::kPlayback, device)) continue;
      VoiceFrame frame;
      mixer_.Mix(frame, MonotonicNow());
      if (Good(device->Write(frame, kMove), health, device) && echo_) echo_->Played(frame);
    }
  }

 private:
  // Opens what was lost; false: not now.
  static bool Ready(const std::stop_token& stop, const std::string& name,
                    PcmDevice::Direction direction, std::optional<PcmDevice>& device) {
    if (device) return true;
    absl::StatusOr<PcmDevice> opened = PcmDevice::Open(name, direction);
    if (!opened.ok()) {
      PauseFor(kAgain, stop);
      return false;
    }
    device = *std::move(opened);
    Log(absl::StrCat("voice: audio device '", name, "' is back"));
    return true;
  }

  struct Health {
    std::string said;
    int late = 0;  // in a row
  };

  static bool Good(const absl::Status& moved, Health& health, std::optional<PcmDevice>& device) {
    if (moved.ok()) {
      health = {};
      return true;
    }
    const bool late = absl::IsDeadlineExceeded(moved);
    if (late && ++health.late < kLateInARow) return false;
    SayOnce(health.said, absl::StrCat("voice: ", moved.message()));
    if (!late) device.reset();
    return false;
  }

  const WearerVoiceOptions options_;
  VoiceMixer mixer_;
  OpusVoiceEncoder encoder_;           // of the capturing thread
  std::optional<EchoCanceller> echo_;  // where both are
  std::mutex mutex_;
  std::condition_variable_any some_;
  std::deque<v1::VoicePacket> waiting_;
};

/// A thread that a device's library may hold for ever: then it is left behind.
class DeviceThread {
 public:
  using Body = void (Devices::*)(const std::stop_token&, std::optional<PcmDevice>);

  DeviceThread(std::shared_ptr<Devices> devices, Body body, std::optional<PcmDevice> device) {
    std::promise<void> done;
    done_ = done.get_future();
    thread_ = std::jthread([devices = std::move(devices), body, device = std::move(device),
                            done = std::move(done)](const std::stop_token& stop) mutable {
      ((*devices).*body)(stop, std::move(device));
      done.set_value();
    });
  }
  ~DeviceThread() {
    thread_.request_stop();
    if (done_.wait_for(kStuck) != std::future_status::ready) thread_.detach();
  }

 private:
  std::future<void> done_;
  std::jthread thread_;
};

}  // namespace

class WearerVoice::Impl {
 public:
  Impl(const WearerVoiceOptions& options, std::shared_ptr<grpc::Channel> channel,
       std::optional<PcmDevice> capture, std::optional<PcmDevice> playback,
       OpusVoiceEncoder encoder)
      : call_(std::move(channel), options.token, options.display_name),
        devices_(std::make_shared<Devices>(options, std::move(encoder))),
        listens_([this](const std::stop_token& stop) { Listen(stop); }),
        sends_([this](const std::stop_token& stop) { Send(stop); }) {
    if (capture) capture_.emplace(devices_, &Devices::Capture, std::move(capture));
    if (playback) playback_.emplace(devices_, &Devices::Play, std::move(playback));
  }

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
        status = call_.Listen(
            [this](const v1::VoiceEvent& event) { devices_->mixer().Hear(event, MonotonicNow()); });
      }
      devices_->mixer().Clear();
      if (stop.stop_requested()) return;
      SayOnce(said, absl::StrCat("voice: ", status.message(), "; tried again every second"));
      PauseFor(kAgain, stop);
    }
  }

  void Send(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const std::vector<v1::VoicePacket> packets = devices_->Take(stop);
      if (!packets.empty()) call_.Send(packets).IgnoreError();  // Listen says what is wrong
    }
  }

  VoiceCall call_;
  const std::shared_ptr<Devices> devices_;
  std::jthread listens_, sends_;
  std::optional<DeviceThread> capture_, playback_;
};

absl::StatusOr<std::unique_ptr<WearerVoice>> WearerVoice::Start(
    const WearerVoiceOptions& options, std::shared_ptr<grpc::Channel> channel) {
  std::optional<PcmDevice> capture, playback;
  const auto open = [](const std::string& name, PcmDevice::Direction direction,
                       std::optional<PcmDevice>& device) {
    if (name.empty()) return absl::OkStatus();
    absl::StatusOr<PcmDevice> opened = PcmDevice::Open(name, direction);
    if (!opened.ok()) return opened.status();
    device = *std::move(opened);
    return absl::OkStatus();
  };
  absl::Status status = open(options.capture, PcmDevice::Direction::kCapture, capture);
  status.Update(open(options.playback, PcmDevice::Direction::kPlayback, playback));
  if (!status.ok()) return status;
  absl::StatusOr<OpusVoiceEncoder> encoder = OpusVoiceEncoder::Create();
  if (!encoder.ok()) return encoder.status();
  return std::unique_ptr<WearerVoice>(new WearerVoice(std::make_unique<Impl>(
      options, std::move(channel), std::move(capture), std::move(playback), *std::move(encoder))));
}

WearerVoice::WearerVoice(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WearerVoice::~WearerVoice() = default;

}  // namespace saccade
