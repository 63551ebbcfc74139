#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <array>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/pipeline/events.hpp"
#include "server/pipeline/pointers.hpp"
#include "server/pipeline/runner.hpp"
#include "server/rpc/backend.hpp"
#include "server/rpc/event_bytes.hpp"
#include "server/rpc/key_frame_requests.hpp"
#include "server/rpc/packet_backlog.hpp"
#include "server/rpc/session_table.hpp"
#include "server/rpc/subscription.hpp"

namespace saccade {

/// One open stream: a Subscription, its lock, and something that writes.
class Subscriber {
 public:
  /// `bytes`: of the hub.
  Subscriber(Session session, const SubscriptionOptions& options, std::shared_ptr<EventBytes> bytes)
      : session_(std::move(session)), subscription_(options, std::move(bytes)) {}
  virtual ~Subscriber() = default;

  const Session& session() const { return session_; }
  VideoView view() const { return subscription_.options().view; }
  bool wants_video() const {
    return subscription_.options().topics.test(static_cast<std::size_t>(v1::TOPIC_VIDEO));
  }

  bool listens() const {
    return subscription_.options().topics.test(static_cast<std::size_t>(v1::TOPIC_VOICE));
  }

  /// Runs `change` on the subscription under its lock, without writing.
  template <typename Change>
  void Set(Change change) {
    const std::lock_guard lock(mutex_);
    change(subscription_);
  }
  /// Runs `change` on the subscription under its lock, then writes what has become due.
  template <typename Change>
  void Update(Change change) {
    Set(change);
    Pump();
  }

  /// Starts a write if none is under way and something is due. Never blocks.
  virtual void Pump() = 0;
  /// Ends the stream with `status`.
  virtual void Close(const absl::Status& status) = 0;
  /// The same for one that is not heard of any more: also a write that it does not take.
  virtual void Abandon(const absl::Status& status) = 0;

  /// Since when it owes an acknowledgement; nothing if it owes none.
  std::optional<Timestamp> unacknowledged_since() {
    const std::lock_guard lock(mutex_);
    return subscription_.unacknowledged_since();
  }

 protected:
  const Session session_;
  std::mutex mutex_;
  Subscription subscription_;
};

/// Hands what the engine publishes to every open stream. Publishing only leaves it here: one thread
/// of the hub's own offers to the streams, so neither tracker nor encoder ever waits for a client.
///
/// It goes round: each time it takes all that has been left since, the newest of everything and the
/// pictures, and offers it to every stream at once. So when there are more streams than the machine
/// can serve the rounds take longer, and all get fewer poses and pictures alike, not older ones.
class StreamHub : public EventSink {
 public:
  /// A stream whose events nobody acknowledges for `silence_ns` ends (DeadlineExceeded): who stands
  /// behind it is gone, whatever its socket says.
  explicit StreamHub(Timestamp silence_ns = 30'000'000'000);
  ~StreamHub() override;

  /// Where key frames are asked for. Before the first Add; `backend` outlives the hub's streams.
  void Connect(Backend* backend);
  Backend* backend() const { return backend_; }
  /// What the streams share of their events.
  const std::shared_ptr<EventBytes>& bytes() const { return bytes_; }

  void OnTracked(const TrackedEvent& event) override;
  void OnVideo(const std::shared_ptr<const VideoPacket>& packet) override;
  void OnStatistics(const EngineStatistics& statistics) override;
  void OnGaze(const std::shared_ptr<const GazeSnapshot>& state) override;
  void OnEndOfSource(std::uint64_t frames) override;
  /// What is pointed at now. Any thread; must come in order.
  void OnPointers(std::shared_ptr<const PointerList> pointers);
  void OnPicturePause(const std::shared_ptr<const PicturePause>& state) override;
  void OnScene(const std::shared_ptr<const Scene>& scene) override;
  void OnSurface(const std::shared_ptr<const SurfaceSnapshot>& surface) override;

  /// To everybody who listens but the speaker.
  void OnVoice(VoiceBatch batch);
  /// The conversation with what was said last. `log` as ChatBook has it.
  void OnChat(const std::shared_ptr<const ChatLog>& log);

  /// Opens a stream; one that the same session had is closed (Aborted).
  void Add(const std::shared_ptr<Subscriber>& subscriber);
  void Remove(const Subscriber* subscriber);
  /// NotFound: the session has no stream.
  absl::Status Acknowledge(const std::string& session_id, std::uint64_t sequence,
                           bool request_key_frame);
  /// A stream needs a key frame of `view`; requests are joined. Any thread.
  void AskForKeyFrame(VideoView view);
  /// Ends the streams of these tokens (Session::access_id) now: nothing more is written to them,
  /// and who does not even take the word of it is cut off.
  void End(const std::vector<std::string>& access_ids, const absl::Status& status);
  /// Ends every stream and takes no more.
  void CloseAll(const absl::Status& status);

  /// Nothing before the first frame.
  std::optional<TrackedEvent> newest() const;
  EngineStatistics statistics() const;
  std::shared_ptr<const v1::PresenceEvent> presence() const;
  std::optional<std::uint64_t> end_of_source() const;
  std::shared_ptr<const PointerList> pointers() const;

 private:
  /// What was left since the last round.
  struct Pending {
    std::optional<TrackedEvent> tracked;
    std::uint64_t frames_passed_over = 0;  // tracked, and replaced by `tracked`
    std::array<PacketBacklog, kVideoViews> video;
    std::optional<EngineStatistics> statistics;
    std::shared_ptr<const GazeSnapshot> gaze;
    std::optional<std::uint64_t> end_frames;
    std::shared_ptr<const PointerList> pointers;
    std::shared_ptr<const Scene> scene;
    std::shared_ptr<const SurfaceSnapshot> surface;
    std::deque<VoiceBatch> voice;
    bool chat = false;
  };
  struct Wake {};
  /// The same, worked out and ready to be offered.
  struct Round;

  /// Changes what is pending under its lock, and wakes the hub's thread.
  template <typename Change>
  void Leave(Change change);
  void GoRound();
  Round Prepare();
  void GrantKeyFrames(Timestamp now_ns);
  void AbandonTheSilent(Timestamp now_ns);
  void AbandonTheEnded(Timestamp now_ns);
  /// False: closed. `replaced` is the stream that the same session had.
  bool Insert(const std::shared_ptr<Subscriber>& subscriber, std::shared_ptr<Subscriber>& replaced);
  std::vector<std::shared_ptr<Subscriber>> Streams() const;
  std::optional<NumberedState> numbered() const;
  void StreamsChanged();

  const Timestamp silence_ns_;
  Backend* backend_ = nullptr;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<Subscriber>> streams_;
  absl::flat_hash_map<std::string, std::shared_ptr<Subscriber>> by_session_;  // the same
  /// Told that they end, and when.
  std::vector<std::pair<std::shared_ptr<Subscriber>, Timestamp>> ended_;
  bool closed_ = false;
  std::optional<TrackedEvent> newest_;
  std::optional<NumberedState> numbered_;  // the newest that the hub's thread has worked out
  EngineStatistics statistics_;
  std::shared_ptr<const v1::PresenceEvent> presence_;
  std::optional<std::uint64_t> end_frames_;
  std::shared_ptr<const PointerList> pointers_;  // null: none so far
  std::shared_ptr<const PicturePause> pause_ = std::make_shared<const PicturePause>();
  std::shared_ptr<const ChatLog> chat_ = std::make_shared<const ChatLog>();
  Pending pending_;
  bool presence_changed_ = false;
  std::array<KeyFrameRequests, kVideoViews> key_frames_;
  const std::shared_ptr<EventBytes> bytes_ = std::make_shared<EventBytes>();
  // The hub's thread.
  ChangeLog log_;
  Timestamp presence_ns_ = 0;  // when it was last told
  std::size_t first_ = 0;      // which stream is next to be first
  Runner<Wake> runner_;        // last: its thread uses everything above
};

}  // namespace saccade
