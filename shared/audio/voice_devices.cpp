#include "shared/audio/voice_devices.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include "shared/audio/echo_canceller.hpp"
#include "shared/audio/opus_voice.hpp"
#include "shared/audio/pcm_device.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kMove(200);    // how soon a thread at a silent device sees that it is to end
constexpr int kLateInARow = 10;       // a busy machine misses some
constexpr milliseconds kStuck(300);   // a device that holds its thread longer keeps it
constexpr milliseconds kAgain(1000);  // between attempts to open
constexpr std::size_t kMostWaitingSamples = 25;  // proto: SpeakRequest.packets
constexpr Timestamp kHangover_ns = 500'000'000;

void PauseFor(milliseconds duration, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, duration, [] { return false; });
}

}  // namespace

/// What the devices' threads share; outlives those that are stuck.
class VoiceDevices::Shared {
 public:
  Shared(VoiceDeviceOptions options, OpusVoiceEncoder encoder)
      : options_(std::move(options)), encoder_(std::move(encoder)) {
    if (!options_.capture.empty() && !options_.playback.empty()) echo_.emplace();
  }

  VoiceMixer& mixer() { return mixer_; }
  void SetOpen(bool open) { open_ = open; }
  Timestamp spoke_ns() const { return spoke_ns_; }
  std::string problem() const {
    const std::lock_guard lock(mutex_);
    return !capture_problem_.empty() ? capture_problem_ : playback_problem_;
  }

  std::vector<VoicePacket> Take(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    some_.wait(lock, stop, [this] { return !waiting_.empty(); });
    std::vector<VoicePacket> packets(std::make_move_iterator(waiting_.begin()),
                                     std::make_move_iterator(waiting_.end()));
    waiting_.clear();
    return packets;
  }

  void Capture(const std::stop_token& stop, std::optional<PcmDevice> device) {
    int late = 0;
    // Above what this microphone, opened anew, has sent before.
    auto sequence = static_cast<std::uint64_t>(MonotonicNow() / kVoiceFrame_ns);
    while (!stop.stop_requested()) {
      if (!Ready(stop, options_.capture, PcmDevice::Direction::kCapture, device)) continue;
      VoiceFrame frame;
      if (!Good(device->Read(frame, kMove), late, capture_problem_, device)) continue;
      ++sequence;
      if (echo_) frame = echo_->Captured(frame);
      const Timestamp now_ns = MonotonicNow();
      if (!Passes(frame, now_ns)) continue;
      VoicePacket packet{sequence, now_ns - kVoiceFrame_ns, encoder_.Encode(frame)};
      if (packet.opus.empty()) continue;
      const std::lock_guard lock(mutex_);
      waiting_.push_back(std::move(packet));
      if (waiting_.size() > kMostWaitingSamples) waiting_.pop_front();  // too old to be heard
      some_.notify_one();
    }
  }

  void Play(const std::stop_token& stop, std::optional<PcmDevice> device) {
    int late = 0;
    while (!stop.stop_requested()) {
      if (!Ready(stop, options_.playback, PcmDevice::Direction::kPlayback, device)) continue;
      VoiceFrame frame;
      mixer_.Mix(frame, MonotonicNow());
      const absl::Status written = device->Write(frame, kMove);
      if (Good(written, late, playback_problem_, device) && echo_) echo_->Played(frame);
    }
  }

 private:
  // Whether a frame is to be sent.
  bool Passes(const VoiceFrame& frame, Timestamp now_ns) {
    if (!open_) {
      loud_ns_ = 0;
      return false;
    }
    if (options_.sent_level <= 0.0) return true;
    if (LoudnessOf(frame) > options_.sent_level) loud_ns_ = spoke_ns_ = now_ns;
    return loud_ns_ != 0 && now_ns - loud_ns_ <= kHangover_ns;
  }

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

  // `late`: how often in a row nothing moved.
  bool Good(const absl::Status& moved, int& late, std::string& problem,
            std::optional<PcmDevice>& device) {
    const bool slow = absl::IsDeadlineExceeded(moved);
    if (slow && ++late < kLateInARow) return false;
    const std::string text = moved.ok() ? "" : std::string(moved.message());
    const bool news = [&] {
      const std::lock_guard lock(mutex_);
      return std::exchange(problem, text) != text;
    }();
    if (moved.ok()) {
      late = 0;
      return true;
    }
    if (news) Log(absl::StrCat("voice: ", text));
    if (!slow) device.reset();
    return false;
  }

  const VoiceDeviceOptions options_;
  VoiceMixer mixer_;
  OpusVoiceEncoder encoder_;           // of the capturing thread
  std::optional<EchoCanceller> echo_;  // where both are
  Timestamp loud_ns_ = 0;              // of the capturing thread
  std::atomic<bool> open_ = true;
  std::atomic<Timestamp> spoke_ns_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable_any some_;
  std::deque<VoicePacket> waiting_;                 // guarded by mutex_
  std::string capture_problem_, playback_problem_;  // likewise
};

/// A thread that a device's library may hold for ever: then it is left behind.
class VoiceDevices::DeviceThread {
 public:
  using Body = void (Shared::*)(const std::stop_token&, std::optional<PcmDevice>);

  DeviceThread(std::shared_ptr<Shared> shared, Body body, PcmDevice device) {
    std::promise<void> done;
    done_ = done.get_future();
    thread_ = std::jthread([shared = std::move(shared), body, device = std::move(device),
                            done = std::move(done)](const std::stop_token& stop) mutable {
      ((*shared).*body)(stop, std::move(device));
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

absl::StatusOr<std::unique_ptr<VoiceDevices>> VoiceDevices::Start(
    const VoiceDeviceOptions& options) {
  absl::StatusOr<OpusVoiceEncoder> encoder = OpusVoiceEncoder::Create();
  if (!encoder.ok()) return encoder.status();
  std::unique_ptr<VoiceDevices> devices(new VoiceDevices);
  devices->shared_ = std::make_shared<Shared>(options, *std::move(encoder));
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
  if (status.ok()) status = open(options.playback, PcmDevice::Direction::kPlayback, playback);
  if (!status.ok()) return status;
  if (capture) {
    devices->capture_ =
        std::make_unique<DeviceThread>(devices->shared_, &Shared::Capture, *std::move(capture));
  }
  if (playback) {
    devices->playback_ =
        std::make_unique<DeviceThread>(devices->shared_, &Shared::Play, *std::move(playback));
  }
  return devices;
}

VoiceDevices::VoiceDevices() = default;
VoiceDevices::~VoiceDevices() = default;

VoiceMixer& VoiceDevices::mixer() { return shared_->mixer(); }
void VoiceDevices::SetOpen(bool open) { shared_->SetOpen(open); }
std::vector<VoicePacket> VoiceDevices::Take(const std::stop_token& stop) {
  return shared_->Take(stop);
}
Timestamp VoiceDevices::spoke_ns() const { return shared_->spoke_ns(); }
std::string VoiceDevices::problem() const { return shared_->problem(); }

}  // namespace saccade
