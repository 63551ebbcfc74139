#include "server/rpc/stream_hub.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>

namespace saccade {
namespace {

// Messages that may wait for the hub's thread: two seconds of everything. A video packet that falls
// out is noticed by its sequence number and costs a key frame.
constexpr std::size_t kBacklog = 256;

}  // namespace

StreamHub::StreamHub(Timestamp silence_ns)
    : silence_ns_(silence_ns),
      presence_(std::make_shared<v1::PresenceEvent>()),
      runner_({.capacity = kBacklog, .when_full = WhenFull::kDropOldest},
              [this](const Message& message) { Distribute(message); }) {}

StreamHub::~StreamHub() { runner_.Stop(); }

void StreamHub::OnTracked(const TrackedEvent& event) {
  {
    const std::lock_guard lock(mutex_);
    newest_ = event;
  }
  runner_.Post(event).IgnoreError();  // stopped: nobody is left to hear it
}

void StreamHub::OnVideo(const std::shared_ptr<const VideoPacket>& packet) {
  runner_.Post(packet).IgnoreError();
}

void StreamHub::OnStatistics(const EngineStatistics& statistics) {
  {
    const std::lock_guard lock(mutex_);
    statistics_ = statistics;
  }
  runner_.Post(statistics).IgnoreError();
}

void StreamHub::OnGaze(const std::shared_ptr<const GazeSnapshot>& state) {
  runner_.Post(state).IgnoreError();
}

void StreamHub::OnEndOfSource(std::uint64_t frames) {
  {
    const std::lock_guard lock(mutex_);
    end_frames_ = frames;
  }
  runner_.Post(EndOfSource{frames}).IgnoreError();
}

void StreamHub::AbandonTheSilent(Timestamp now_ns) {
  std::vector<std::shared_ptr<Subscriber>> silent;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(streams_, [&](const std::shared_ptr<Subscriber>& stream) {
      const std::optional<Timestamp> since_ns = stream->unacknowledged_since();
      if (!since_ns || now_ns - *since_ns < silence_ns_) return false;
      silent.push_back(stream);
      return true;
    });
  }
  if (!silent.empty()) StreamsChanged();
  for (const auto& stream : silent) {
    stream->Abandon(absl::DeadlineExceededError(absl::StrCat(
        "no event was acknowledged for ", silence_ns_ / 1'000'000'000, " s: subscribe again")));
  }
}

void StreamHub::Distribute(const Message& message) {
  // Statistics come once a second.
  if (std::holds_alternative<EngineStatistics>(message)) AbandonTheSilent(MonotonicNow());
  std::optional<NumberedState> state;
  if (const auto* tracked = std::get_if<TrackedEvent>(&message)) {
    state = log_.Next(*tracked, MonotonicNow());
    const std::lock_guard lock(mutex_);
    numbered_ = state;
  }
  const std::shared_ptr<const v1::PresenceEvent> present = presence();
  for (const std::shared_ptr<Subscriber>& stream : Streams()) {
    stream->Update([&](Subscription& subscription) {
      if (state) {
        subscription.Offer(*state);
      } else if (const auto* packet = std::get_if<std::shared_ptr<const VideoPacket>>(&message)) {
        subscription.Offer(*packet);
      } else if (const auto* statistics = std::get_if<EngineStatistics>(&message)) {
        subscription.Offer(*statistics);
      } else if (const auto* gaze = std::get_if<std::shared_ptr<const GazeSnapshot>>(&message)) {
        subscription.OfferGaze(*gaze);
      } else if (const auto* end = std::get_if<EndOfSource>(&message)) {
        subscription.OfferEnd(end->frames);
      } else {
        subscription.OfferPresence(present);
      }
    });
  }
}

void StreamHub::Add(const std::shared_ptr<Subscriber>& subscriber) {
  const auto offer_state = [&] {
    const std::optional<NumberedState> state = numbered();
    const std::optional<std::uint64_t> end = end_of_source();
    const std::shared_ptr<const v1::PresenceEvent> present = presence();
    subscriber->Update([&](Subscription& subscription) {
      if (state) subscription.Offer(*state);
      subscription.OfferGaze(backend_->gaze());
      if (end) subscription.OfferEnd(*end);
      subscription.OfferPresence(present);
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
  const auto same = std::find_if(streams_.begin(), streams_.end(), [&](const auto& other) {
    return other->session().id == subscriber->session().id;
  });
  if (same != streams_.end()) {
    replaced = *same;
    streams_.erase(same);
  }
  streams_.push_back(subscriber);
  return true;
}

void StreamHub::Remove(const Subscriber* subscriber) {
  {
    const std::lock_guard lock(mutex_);
    if (std::erase_if(streams_,
                      [subscriber](const auto& one) { return one.get() == subscriber; }) == 0) {
      return;
    }
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
      v1::Participant& participant = *presence->add_participants();
      participant.set_participant_id(stream->session().participant_id);
      participant.set_display_name(stream->session().display_name);
      participant.set_role(stream->session().role);
      present->insert(stream->session().participant_id);
      if (stream->wants_video()) wanted[static_cast<std::size_t>(stream->view())] = true;
    }
    presence_ = presence;
    backend_->SetPresence(std::move(present));
    for (int view = 0; view < kVideoViews; ++view) {
      backend_->SetVideoDemand(static_cast<VideoView>(view),
                               wanted[static_cast<std::size_t>(view)]);
    }
  }
  runner_.Post(PresenceChanged{}).IgnoreError();
}

absl::Status StreamHub::Acknowledge(const std::string& session_id, std::uint64_t sequence,
                                    bool request_key_frame) {
  for (const std::shared_ptr<Subscriber>& stream : Streams()) {
    if (stream->session().id != session_id) continue;
    absl::Status result;
    stream->Update([&](Subscription& subscription) {
      result = subscription.Acknowledge(sequence, request_key_frame);
    });
    return result;
  }
  return absl::NotFoundError("session_id: this session has no stream: call Subscribe");
}

void StreamHub::CloseAll(const absl::Status& status) {
  std::vector<std::shared_ptr<Subscriber>> streams;
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    streams.swap(streams_);
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

std::optional<std::uint64_t> StreamHub::end_of_source() const {
  const std::lock_guard lock(mutex_);
  return end_frames_;
}

}  // namespace saccade
