#include "server/rpc/stream_hub.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <utility>

namespace saccade {
namespace {

// Who came and went is told at most so often: each telling names everybody to everybody.
constexpr Timestamp kPresenceInterval = 250'000'000;
// So long a stream that is ended may take to say why.
constexpr Timestamp kLastWords = 300'000'000;
// Batches of voice that wait for the hub: seconds of several speakers. Newer ones win.
constexpr std::size_t kVoiceWaiting = 256;

}  // namespace

StreamHub::StreamHub(Timestamp silence_ns)
    : silence_ns_(silence_ns),
      presence_(std::make_shared<v1::PresenceEvent>()),
      runner_({.capacity = 1, .when_full = WhenFull::kDropOldest}, [this](Wake) { GoRound(); }) {}

StreamHub::~StreamHub() { runner_.Stop(); }

template <typename Change>
void StreamHub::Leave(Change change) {
  {
    const std::lock_guard lock(mutex_);
    change(pending_);
  }
  runner_.Post(Wake()).IgnoreError();  // stopped: nobody is left to hear it
}

void StreamHub::OnTracked(const TrackedEvent& event) {
  Leave([&](Pending& pending) {
    if (pending.tracked && pending.tracked->snapshot != event.snapshot) {
      ++pending.frames_passed_over;
    }
    newest_ = pending.tracked = event;
  });
}

void StreamHub::OnVideo(const std::shared_ptr<const VideoPacket>& packet) {
  Leave([&](Pending& pending) {
    if (pause_->paused) return;  // coded just before
    const auto view = static_cast<std::size_t>(packet->view);
    if (packet->key_frame) key_frames_[view].Made();
    pending.video[view].Push(packet);
  });
}

void StreamHub::OnStatistics(const EngineStatistics& statistics) {
  Leave([&](Pending& pending) { statistics_ = *(pending.statistics = statistics); });
}

void StreamHub::OnGaze(const std::shared_ptr<const GazeSnapshot>& state) {
  Leave([&](Pending& pending) { pending.gaze = state; });
}

void StreamHub::OnEndOfSource(std::uint64_t frames) {
  Leave([&](Pending& pending) { end_frames_ = pending.end_frames = frames; });
}

void StreamHub::OnPointers(std::shared_ptr<const PointerList> pointers) {
  Leave([&](Pending& pending) { pointers_ = pending.pointers = std::move(pointers); });
}

void StreamHub::OnScene(const std::shared_ptr<const Scene>& scene) {
  Leave([&](Pending& pending) { pending.scene = scene; });
}

void StreamHub::OnSurface(const std::shared_ptr<const SurfaceSnapshot>& surface) {
  Leave([&](Pending& pending) { pending.surface = surface; });
}

void StreamHub::Connect(Backend* backend) {
  backend_ = backend;
  const std::lock_guard lock(mutex_);
  pause_ = backend->picture_pause();
}

// By the caller's thread, not in the next round: what waits in a stream is thrown away before this
// returns. A stream that comes meanwhile has it from Insert.
void StreamHub::OnPicturePause(const std::shared_ptr<const PicturePause>& state) {
  std::vector<std::shared_ptr<Subscriber>> streams;
  {
    const std::lock_guard lock(mutex_);
    pause_ = state;
    for (PacketBacklog& view : pending_.video) view.TakeAll();
    streams = streams_;
  }
  for (const auto& stream : streams) {
    stream->Update([&state](Subscription& subscription) { subscription.OfferPicturePause(state); });
  }
}

void StreamHub::OnVoice(VoiceBatch batch) {
  Leave([&](Pending& pending) {
    pending.voice.push_back(std::move(batch));
    if (pending.voice.size() > kVoiceWaiting) pending.voice.pop_front();
  });
}

void StreamHub::OnChat(const std::shared_ptr<const ChatLog>& log) {
  Leave([&](Pending& pending) {
    // Two who speak at once may come here in either order.
    if (!chat_->empty() && chat_->back()->number() >= log->back()->number()) return;
    chat_ = log;
    pending.chat = true;
  });
}

void StreamHub::AbandonTheSilent(Timestamp now_ns) {
  std::vector<std::shared_ptr<Subscriber>> silent;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(streams_, [&](const std::shared_ptr<Subscriber>& stream) {
      const std::optional<Timestamp> since_ns = stream->unacknowledged_since();
      if (!since_ns || now_ns - *since_ns < silence_ns_) return false;
      silent.push_back(stream);
      by_session_.erase(stream->session().id);
      return true;
    });
  }
  if (!silent.empty()) StreamsChanged();
  for (const auto& stream : silent) {
    stream->Abandon(absl::DeadlineExceededError(absl::StrCat(
        "no event was acknowledged for ", silence_ns_ / 1'000'000'000, " s: subscribe again")));
  }
}

void StreamHub::End(const std::vector<std::string>& access_ids, const absl::Status& status) {
  std::vector<std::shared_ptr<Subscriber>> ended;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(streams_, [&](const std::shared_ptr<Subscriber>& stream) {
      const std::string& id = stream->session().access_id;
      if (std::find(access_ids.begin(), access_ids.end(), id) == access_ids.end()) return false;
      ended.push_back(stream);
      ended_.emplace_back(stream, MonotonicNow());
      by_session_.erase(stream->session().id);
      return true;
    });
  }
  if (ended.empty()) return;
  StreamsChanged();
  for (const auto& stream : ended) stream->Close(status);
}

// A write under way has a moment to end, and the word of the end to follow it.
void StreamHub::AbandonTheEnded(Timestamp now_ns) {
  std::vector<std::shared_ptr<Subscriber>> late;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(ended_, [&](const auto& entry) {
      if (now_ns - entry.second < kLastWords) return false;
      late.push_back(entry.first);
      return true;
    });
  }
  for (const auto& stream : late) stream->Abandon(absl::CancelledError("access: ended"));
}

struct StreamHub::Round {
  std::optional<NumberedState> state;
  std::uint64_t frames_passed_over = 0;
  std::vector<PacketBacklog::Entry> video;  // of both views
  std::optional<EngineStatistics> statistics;
  std::shared_ptr<const GazeSnapshot> gaze;
  std::optional<std::uint64_t> end_frames;
  std::shared_ptr<const v1::PresenceEvent> presence;
  std::shared_ptr<const PointerList> pointers;
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const SurfaceSnapshot> surface;
  std::shared_ptr<const ChatLog> chat;
  std::deque<VoiceBatch> voice;

  void OfferTo(Subscription& subscription, const Session& session) const {
    for (const VoiceBatch& batch : voice) {
      if (batch.participant_id != session.participant_id) subscription.OfferVoice(batch);
    }
    if (chat) subscription.OfferChat(chat);
    if (state) subscription.Offer(*state, frames_passed_over);
    for (const PacketBacklog::Entry& entry : video) {
      entry.shed ? subscription.Skip(*entry.packet) : subscription.Offer(entry.packet);
    }
    if (statistics) subscription.Offer(*statistics);
    if (gaze) subscription.OfferGaze(gaze);
    if (end_frames) subscription.OfferEnd(*end_frames);
    if (presence) subscription.OfferPresence(presence);
    if (pointers) subscription.OfferPointers(pointers);
    if (scene) subscription.OfferScene(scene);
    if (surface) subscription.OfferSurface(surface);
  }
};

StreamHub::Round StreamHub::Prepare() {
  Round round;
  std::optional<TrackedEvent> tracked;
  const Timestamp now_ns = MonotonicNow();
  {
    const std::lock_guard lock(mutex_);
    Pending pending = std::exchange(pending_, Pending());
    tracked = std::move(pending.tracked);
    round.frames_passed_over = pending.frames_passed_over;
    for (PacketBacklog& view : pending.video) {
      for (PacketBacklog::Entry& entry : view.TakeAll()) round.video.push_back(std::move(entry));
    }
    round.statistics = pending.statistics;
    round.gaze = std::move(pending.gaze);
    round.end_frames = pending.end_frames;
    round.pointers = std::move(pending.pointers);
    round.scene = std::move(pending.scene);
    round.surface = std::move(pending.surface);
    round.voice = std::move(pending.voice);
    if (pending.chat) round.chat = chat_;
    if (presence_changed_ && now_ns - presence_ns_ >= kPresenceInterval) {
      presence_changed_ = false;
      presence_ns_ = now_ns;
      round.presence = presence_;
    }
  }
  if (tracked) {
    round.state = log_.Next(*tracked, now_ns);
    const std::lock_guard lock(mutex_);
    numbered_ = round.state;
  }
  return round;
}

void StreamHub::AskForKeyFrame(VideoView view) {
  {
    const std::lock_guard lock(mutex_);
    key_frames_[static_cast<std::size_t>(view)].Ask();
  }
  GrantKeyFrames(MonotonicNow());
}

void StreamHub::GrantKeyFrames(Timestamp now_ns) {
  for (int view = 0; view < kVideoViews; ++view) {
    bool granted = false;
    {
      const std::lock_guard lock(mutex_);
      granted = key_frames_[static_cast<std::size_t>(view)].Grant(now_ns);
    }
    if (granted) backend_->RequestKeyFrame(static_cast<VideoView>(view));
  }
}

void StreamHub::GoRound() {
  const Round round = Prepare();
  GrantKeyFrames(MonotonicNow());                          // what had to wait
  if (round.statistics) AbandonTheSilent(MonotonicNow());  // once a second
  AbandonTheEnded(MonotonicNow());
  const std::vector<std::shared_ptr<Subscriber>> streams = Streams();
  if (streams.empty()) return;
  // Not the same one first each time: who comes late in a round that is too long waits longest.
  first_ = (first_ + streams.size() / 3 + 1) % streams.size();
  for (std::size_t i = 0; i < streams.size(); ++i) {
    Subscriber& stream = *streams[(first_ + i) % streams.size()];
    stream.Update(
        [&](Subscription& subscription) { round.OfferTo(subscription, stream.session()); });
  }
}

void StreamHub::Add(const std::shared_ptr<Subscriber>& subscriber) {
  const auto offer_state = [&] {
    const std::optional<NumberedState> state = numbered();
    const std::optional<std::uint64_t> end = end_of_source();
    const std::shared_ptr<const v1::PresenceEvent> present = presence();
    const std::shared_ptr<const PointerList> pointing = pointers();
    subscriber->Update([&](Subscription& subscription) {
      if (state) subscription.Offer(*state);
      subscription.OfferGaze(backend_->gaze());
      subscription.OfferScene(backend_->scene());
      if (const auto surface = backend_->surface()) subscription.OfferSurface(surface);
      if (end) subscription.OfferEnd(*end);
      subscription.OfferPresence(present);
      if (pointing) subscription.OfferPointers(pointing);
    });
  };
  // Before the hub's thread knows of it: the first events are the whole state. And once more after,
  // for what happened in between.
  offer_state();
  std::shared_ptr<Subscriber> replaced;
  if (!Insert(subscriber, replaced)) {
    return subscriber->Close(absl::UnavailableError("the server is shutting down"));
  }
  if (replaced != nullptr) {
    replaced->Close(absl::AbortedError("session_id: this session opened another stream"));
  }
  StreamsChanged();
  offer_state();
}

bool StreamHub::Insert(const std::shared_ptr<Subscriber>& subscriber,
                       std::shared_ptr<Subscriber>& replaced) {
  const std::lock_guard lock(mutex_);
  if (closed_) return false;
  subscriber->Set([this](Subscription& subscription) {
    subscription.OfferPicturePause(pause_);
    subscription.OfferChat(chat_);
  });
  std::shared_ptr<Subscriber>& held = by_session_[subscriber->session().id];
  replaced = std::exchange(held, subscriber);
  if (replaced != nullptr) std::erase(streams_, replaced);
  streams_.push_back(subscriber);
  return true;
}

void StreamHub::Remove(const Subscriber* subscriber) {
  {
    const std::lock_guard lock(mutex_);
    const auto same = [subscriber](const auto& one) { return one.get() == subscriber; };
    if (std::erase_if(streams_, same) == 0) return;
    by_session_.erase(subscriber->session().id);
  }
  StreamsChanged();
}

// Who is there changed: tell the others, and the encoder whether anybody watches.
void StreamHub::StreamsChanged() {
  auto presence = std::make_shared<v1::PresenceEvent>();
  auto present = std::make_shared<ParticipantSet>();
  std::array<bool, kVideoViews> wanted{};
  {
    const std::lock_guard lock(mutex_);
    for (const auto& stream : streams_) {
      if (stream->wants_video()) wanted[static_cast<std::size_t>(stream->view())] = true;
      // A recording has two streams.
      if (!present->insert(stream->session().participant_id).second) continue;
      v1::Participant& participant = *presence->add_participants();
      participant.set_participant_id(stream->session().participant_id);
      participant.set_display_name(stream->session().display_name);
      participant.set_role(stream->session().role);
      participant.set_person_id(stream->session().person_id);
      participant.set_color_rgba(stream->session().color_rgba);
      participant.set_listens(stream->listens());
    }
    presence_ = presence;
    backend_->SetPresence(std::move(present));
    for (int view = 0; view < kVideoViews; ++view) {
      backend_->SetVideoDemand(static_cast<VideoView>(view),
                               wanted[static_cast<std::size_t>(view)]);
    }
  }
  Leave([this](Pending&) { presence_changed_ = true; });
}

absl::Status StreamHub::Acknowledge(const std::string& session_id, std::uint64_t sequence,
                                    bool request_key_frame) {
  std::shared_ptr<Subscriber> stream;
  {
    const std::lock_guard lock(mutex_);
    const auto found = by_session_.find(session_id);
    if (found != by_session_.end()) stream = found->second;
  }
  if (stream == nullptr) {
    return absl::NotFoundError("session_id: this session has no stream: call Subscribe");
  }
  absl::Status result;
  stream->Update([&](Subscription& subscription) {
    result = subscription.Acknowledge(sequence, request_key_frame);
  });
  return result;
}

void StreamHub::CloseAll(const absl::Status& status) {
  std::vector<std::shared_ptr<Subscriber>> streams;
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    streams.swap(streams_);
    by_session_.clear();
  }
  for (const auto& stream : streams) stream->Close(status);
}

std::vector<std::shared_ptr<Subscriber>> StreamHub::Streams() const {
  const std::lock_guard lock(mutex_);
  return streams_;
}

std::optional<TrackedEvent> StreamHub::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

std::optional<NumberedState> StreamHub::numbered() const {
  const std::lock_guard lock(mutex_);
  return numbered_;
}

EngineStatistics StreamHub::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

std::shared_ptr<const v1::PresenceEvent> StreamHub::presence() const {
  const std::lock_guard lock(mutex_);
  return presence_;
}

std::shared_ptr<const PointerList> StreamHub::pointers() const {
  const std::lock_guard lock(mutex_);
  return pointers_;
}

std::optional<std::uint64_t> StreamHub::end_of_source() const {
  const std::lock_guard lock(mutex_);
  return end_frames_;
}

}  // namespace saccade
