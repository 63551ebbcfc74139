#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <bitset>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "saccade/v1/session.pb.h"
#include "server/pipeline/events.hpp"
#include "server/pipeline/pointers.hpp"
#include "server/rpc/chat_book.hpp"
#include "server/rpc/deltas.hpp"
#include "server/rpc/event_bytes.hpp"
#include "server/rpc/pointer_reader.hpp"
#include "server/rpc/scene_reader.hpp"
#include "server/rpc/video_queue.hpp"
#include "server/rpc/voice_queue.hpp"

namespace saccade {

/// What a subscriber asked for, checked.
struct SubscriptionOptions {
  std::bitset<16> topics;  // by v1::Topic
  VideoView view = VideoView::kRaw;
  std::uint32_t window = 32;  // events in flight unacknowledged

  /// InvalidArgument names the field.
  static absl::StatusOr<SubscriptionOptions> FromProto(const v1::SubscribeRequest& request);
};

/// The bounded state of one stream: the newest of everything, and which of it was sent.
///
/// Offers only overwrite; Next decides what goes out. So a subscriber costs a few pointers however
/// slow it is, and what it gets late is the newest, not a backlog. Knows nothing of gRPC; not
/// thread safe.
class Subscription {
 public:
  /// `bytes`: shared by the subscriptions of one hub; null: of its own.
  explicit Subscription(const SubscriptionOptions& options,
                        std::shared_ptr<EventBytes> bytes = nullptr)
      : options_(options), bytes_(bytes ? std::move(bytes) : std::make_shared<EventBytes>()) {}

  /// `frames_passed_over`: newer than the last one offered, and replaced by this one.
  void Offer(const NumberedState& state, std::uint64_t frames_passed_over = 0);
  void Offer(const std::shared_ptr<const VideoPacket>& packet);
  /// In place of a packet that nobody is sent.
  void Skip(const VideoPacket& packet);
  void Offer(const EngineStatistics& statistics);
  void OfferGaze(std::shared_ptr<const GazeSnapshot> state);
  void OfferPresence(std::shared_ptr<const v1::PresenceEvent> presence);
  void OfferPointers(std::shared_ptr<const PointerList> pointers) {
    pointers_ = std::move(pointers);
    pointers_due_ = true;
  }
  /// Never null; an older one than the last is passed over.
  void OfferScene(std::shared_ptr<const Scene> scene) {
    if (scene_ != nullptr && scene->revision <= scene_->revision) return;
    scene_ = std::move(scene);
    scene_due_ = true;
  }
  /// Only how new it is goes out; chunks are asked for.
  void OfferSurface(const std::shared_ptr<const SurfaceSnapshot>& surface) {
    const std::pair now(surface->edition, surface->version);
    if (surface_ == now) return;
    surface_ = now;
    surface_due_ = true;
  }
  void OfferEnd(std::uint64_t frames) {
    if (!std::exchange(end_seen_, true)) end_frames_ = frames;
  }

  /// Of the conversation what is newer than the last one offered; of the first one nothing.
  void OfferChat(std::shared_ptr<const ChatLog> log);
  void OfferVoice(const VoiceBatch& batch);
  /// While it is paused no picture is taken or given; then there is a key frame first.
  void OfferPicturePause(std::shared_ptr<const PicturePause> state);

  /// InvalidArgument: `sequence` was never sent.
  absl::Status Acknowledge(std::uint64_t sequence, bool request_key_frame,
                           Timestamp now_ns = MonotonicNow());

  /// Fills the next event, if there is one and the window allows it. Kinds take turns, so that
  /// video cannot starve the map; a new subscriber has annotations and map before any picture.
  /// Voice comes before everything, and has kVoiceBeyond events more than the window: who is behind
  /// with pictures still hears.
  bool Next(Timestamp now_ns, EncodedEvent& event);

  /// True if the encoder should be asked for a key frame now (only while events may be sent).
  bool WantsKeyFrame(Timestamp now_ns);

  const SubscriptionOptions& options() const { return options_; }
  std::uint64_t last_sequence() const { return sequence_; }
  /// Since when the oldest of what was sent, or the last acknowledgement, waits for the next one.
  std::optional<Timestamp> unacknowledged_since() const { return unacknowledged_since_; }

 private:
  enum Kind {
    kAnnotations,
    kMap,
    kPresence,
    kGaze,
    kPicturePause,
    kChat,
    kPose,
    kVideo,
    kStatistics,
    kPointers,
    kScene,
    kSurface,
    kEnd,
    kKinds
  };
  static constexpr std::uint32_t kVoiceBeyond = 50;

  bool Has(v1::Topic topic) const { return options_.topics.test(static_cast<std::size_t>(topic)); }
  bool WindowOpen(std::uint32_t beyond = 0) const {
    return sequence_ - acknowledged_ < options_.window + beyond;
  }
  /// A field of an Event.
  struct Payload {
    int field;
    Bytes bytes;
    std::string tail = {};
  };
  std::optional<Payload> Fill(Kind kind, Timestamp now_ns);
  std::optional<Payload> FillAnnotations();
  std::optional<Payload> FillMap();
  std::optional<Payload> FillVideo(Timestamp now_ns);
  std::optional<Payload> FillPointers();
  std::optional<Payload> FillScene();
  std::optional<Payload> FillSurface();
  std::optional<Payload> FillChat();
  std::optional<Payload> FillVoice();

  const SubscriptionOptions options_;
  const std::shared_ptr<EventBytes> bytes_;
  std::uint64_t sequence_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::optional<Timestamp> unacknowledged_since_;
  int last_kind_ = kKinds - 1;

  std::optional<NumberedState> state_;  // the newest
  // Whether `state_` is yet to be looked at, by kind.
  bool pose_due_ = false, map_due_ = false, annotations_due_ = false;
  // No mount, until somebody says otherwise.
  std::shared_ptr<const GazeSnapshot> gaze_ = std::make_shared<const GazeSnapshot>();
  std::shared_ptr<const GazeSnapshot> gaze_seen_;
  MapReader map_;
  AnnotationReader annotations_;
  VideoQueue video_;
  std::shared_ptr<const v1::PresenceEvent> presence_, presence_seen_;
  std::shared_ptr<const PointerList> pointers_;  // null: none so far
  bool pointers_due_ = false;
  PointerReader pointer_reader_;
  std::shared_ptr<const Scene> scene_;  // null: none so far
  bool scene_due_ = false;
  SceneReader scene_reader_;
  std::pair<std::uint64_t, std::uint64_t> surface_{};  // edition, version; 0, 0: none so far
  bool surface_due_ = false;
  std::optional<EngineStatistics> statistics_;
  std::optional<std::uint64_t> end_frames_;
  bool end_seen_ = false;
  std::shared_ptr<const PicturePause> pause_;  // the newest; null: nobody said anything
  bool pause_due_ = false;
  std::shared_ptr<const ChatLog> chat_;  // null: none was offered
  std::uint64_t chat_sent_ = 0;          // number
  VoiceQueue voice_;
  std::uint64_t poses_skipped_ = 0;
};

v1::PicturePause PicturePauseToProto(const PicturePause& state);
v1::StatisticsEvent StatisticsToProto(const EngineStatistics& statistics,
                                      std::uint64_t events_skipped);

}  // namespace saccade
