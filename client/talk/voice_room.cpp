#include "client/talk/voice_room.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <stop_token>
#include <utility>

namespace saccade::talk {
namespace {

constexpr double kSentLevel = 0.003;
constexpr Timestamp kLit_ns = 350'000'000;  // a name stays lit between words
constexpr int kFailing = 3;                 // calls in a row

}  // namespace

/// What the thread shares with whoever draws; one from joining to leaving.
class VoiceRoom::Work {
 public:
  void Run(const std::stop_token& stop, const VoiceOptions& options, session::Session& session,
           const std::function<void()>& wake) {
    Open(options);
    wake();
    const std::shared_ptr<VoiceDevices> opened = devices();
    if (opened == nullptr) return;
    int failures = 0;
    while (!stop.stop_requested()) {
      std::vector<VoicePacket> packets = opened->Take(stop);
      if (packets.empty()) continue;
      for (VoicePacket& packet : packets) packet.capture_ns += offset_ns_;
      const absl::Status sent = session.Speak(packets);
      failures = sent.ok() ? 0 : failures + 1;
      Say(failures < kFailing
              ? ""
              : absl::StrCat("Your voice does not get through to the server: ", sent.message()));
    }
    const std::lock_guard lock(mutex_);
    devices_ = nullptr;
  }

  std::shared_ptr<VoiceDevices> devices() const {
    const std::lock_guard lock(mutex_);
    return devices_;
  }
  /// What is said of it; `over`: it cannot go on.
  struct News {
    bool over = false, on = false, microphone = false;
    std::string problem{};
  };
  News news() const {
    const std::lock_guard lock(mutex_);
    News told = news_;
    if (devices_ != nullptr && told.problem.empty()) told.problem = devices_->problem();
    return told;
  }
  void SetOffset(Timestamp offset_ns) { offset_ns_ = offset_ns; }

 private:
  void Open(const VoiceOptions& options) {
    const auto with = [&options](const std::string& microphone) {
      return VoiceDevices::Start(
          {.capture = microphone, .playback = options.loudspeaker, .sent_level = kSentLevel});
    };
    auto opened = with(options.microphone);
    News told{.on = true, .microphone = opened.ok() && !options.microphone.empty()};
    if (!opened.ok()) {
      told.problem = absl::StrCat("You are not heard: ", opened.status().message());
      opened = with("");
    }
    if (!opened.ok()) {
      told = {.over = true, .problem = absl::StrCat("No sound: ", opened.status().message())};
    }
    const std::lock_guard lock(mutex_);
    if (opened.ok()) devices_ = *std::move(opened);
    news_ = told;
    kept_ = told.problem;
  }
  void Say(const std::string& problem) {
    const std::lock_guard lock(mutex_);
    news_.problem = problem.empty() ? kept_ : problem;
  }

  mutable std::mutex mutex_;
  std::shared_ptr<VoiceDevices> devices_;
  News news_;
  std::string kept_;  // what opening left
  std::atomic<Timestamp> offset_ns_ = 0;
};

VoiceRoom::VoiceRoom(VoiceOptions options, std::function<void()> wake)
    : options_(std::move(options)), wake_(std::move(wake)) {}
VoiceRoom::~VoiceRoom() = default;

void VoiceRoom::Hear(const net::VoiceNews& news) {
  std::shared_ptr<Work> work;
  {
    const std::lock_guard lock(mutex_);
    work = work_;
  }
  const std::shared_ptr<VoiceDevices> devices = work ? work->devices() : nullptr;
  if (devices != nullptr) {
    devices->mixer().Hear(news.participant_id, news.packets, MonotonicNow());
  }
}

void VoiceRoom::Join(session::Session& session) {
  if (state_ != State::kOff) return;
  state_ = State::kOpening;
  problem_.clear();
  session.Listen(true);
  const auto work = std::make_shared<Work>();
  {
    const std::lock_guard lock(mutex_);
    work_ = work;
  }
  thread_ =
      std::jthread([work, options = options_, &session, wake = wake_](const std::stop_token& stop) {
        work->Run(stop, options, session, wake);
      });
}

void VoiceRoom::Leave(session::Session& session) {
  if (state_ == State::kOff) return;
  session.Listen(false);
  thread_.request_stop();
  ended_.push_back(std::move(thread_));
  const std::lock_guard lock(mutex_);
  work_ = nullptr;
  state_ = State::kOff;
  has_microphone_ = pressed_ = false;
  problem_.clear();
  speaking_.clear();
}

void VoiceRoom::End(session::Session& session) {
  Leave(session);
  ended_.clear();
}

void VoiceRoom::ToggleMute() {
  muted_ = !muted_;
  Apply();
}

void VoiceRoom::TogglePushToTalk() {
  push_to_talk_ = !push_to_talk_;
  Apply();
}

void VoiceRoom::Press(bool pressed) {
  pressed_ = pressed;
  Apply();
}

bool VoiceRoom::open() const {
  return state_ == State::kOn && has_microphone_ && !muted_ && (!push_to_talk_ || pressed_);
}

void VoiceRoom::Apply() {
  const std::lock_guard lock(mutex_);
  if (const auto devices = work_ ? work_->devices() : nullptr) devices->SetOpen(open());
}

bool VoiceRoom::Check(session::Session& session, Timestamp now_ns) {
  std::shared_ptr<Work> work;
  {
    const std::lock_guard lock(mutex_);
    work = work_;
  }
  if (work == nullptr) return false;
  const Work::News news = work->news();
  if (news.over) {
    Leave(session);
    problem_ = news.problem;
    return true;
  }
  work->SetOffset(session.state().clock.offset_ns().value_or(0));
  std::vector<std::string> speaking;
  if (const std::shared_ptr<VoiceDevices> devices = work->devices()) {
    speaking = devices->mixer().Speaking(now_ns, kLit_ns);
    const Timestamp own_ns = devices->spoke_ns();
    if (own_ns != 0 && now_ns - own_ns < kLit_ns) {
      speaking.push_back(session.state().joined.participant_id);
    }
    std::sort(speaking.begin(), speaking.end());
  }
  const bool opened = news.on && state_ == State::kOpening;
  if (opened) state_ = State::kOn;
  has_microphone_ = news.microphone;
  if (opened) Apply();
  const bool changed = opened || problem_ != news.problem || speaking_ != speaking;
  problem_ = news.problem;
  speaking_ = std::move(speaking);
  return changed;
}

bool VoiceRoom::Speaks(const std::string& participant_id) const {
  return std::binary_search(speaking_.begin(), speaking_.end(), participant_id);
}

std::string VoiceRoom::Words() const {
  if (state_ == State::kOff) return "";
  if (state_ == State::kOpening) return "Opening the sound.";
  if (!has_microphone_) return "You hear the others.";
  if (muted_) return "You are muted.";
  if (!push_to_talk_) return "You are heard.";
  return pressed_ ? "You are heard while you hold." : "Hold Space to be heard.";
}

}  // namespace saccade::talk
