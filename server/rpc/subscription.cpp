#include "server/rpc/subscription.hpp"

#include <absl/strings/str_cat.h>

namespace saccade {
namespace {

constexpr std::uint32_t kDefaultWindow = 32;
constexpr std::uint32_t kMaxWindow = 256;
constexpr std::ptrdiff_t kMessagesOfEvent = 100;  // 60 KB

// What only this subscriber's stream knows of a picture; merges with its other stages.
std::string QueuedStage(Timestamp now_ns) {
  v1::AccessUnit unit;
  unit.mutable_stages()->set_queued_ns(now_ns);
  return unit.SerializeAsString();
}

Bytes Serialized(const google::protobuf::Message& message) {
  return std::make_shared<const std::string>(message.SerializeAsString());
}

}  // namespace

absl::StatusOr<SubscriptionOptions> SubscriptionOptions::FromProto(
    const v1::SubscribeRequest& request) {
  SubscriptionOptions options;
  if (request.topics().empty()) options.topics.set().reset(v1::TOPIC_VOICE);
  for (int i = 0; i < request.topics_size(); ++i) {
    const int topic = request.topics(i);
    if (topic == v1::TOPIC_UNSPECIFIED || !v1::Topic_IsValid(topic)) {
      return absl::InvalidArgumentError(absl::StrCat("topics[", i, "]: unknown topic ", topic));
    }
    options.topics.set(static_cast<std::size_t>(topic));
  }
  if (!v1::VideoView_IsValid(request.video_view())) {
    return absl::InvalidArgumentError(
        absl::StrCat("video_view: unknown view ", static_cast<int>(request.video_view())));
  }
  if (request.video_view() == v1::VIDEO_VIEW_AUGMENTED) options.view = VideoView::kAugmented;
  if (request.window() > kMaxWindow) {
    return absl::InvalidArgumentError(
        absl::StrCat("window: ", request.window(), " is above ", kMaxWindow));
  }
  options.window = request.window() == 0 ? kDefaultWindow : request.window();
  return options;
}

void Subscription::Offer(const NumberedState& state, std::uint64_t frames_passed_over) {
  // Between frames the annotations alone change: the pose is known already.
  const bool same_frame = state_ && state_->tracked.snapshot == state.tracked.snapshot;
  state_ = state;
  annotations_due_ = true;
  if (same_frame) return;
  if (Has(v1::TOPIC_POSE)) poses_skipped_ += frames_passed_over + (pose_due_ ? 1 : 0);
  pose_due_ = map_due_ = true;
}

void Subscription::Offer(const std::shared_ptr<const VideoPacket>& packet) {
  if (pause_ && pause_->paused) return;
  if (Has(v1::TOPIC_VIDEO) && packet->view == options_.view) video_.Push(packet);
}

void Subscription::Skip(const VideoPacket& packet) {
  if (Has(v1::TOPIC_VIDEO) && packet.view == options_.view) video_.Skip(packet);
}

void Subscription::Offer(const EngineStatistics& statistics) { statistics_ = statistics; }

void Subscription::OfferGaze(std::shared_ptr<const GazeSnapshot> state) {
  if (state == gaze_seen_) return;
  gaze_seen_ = state;
  gaze_ = std::move(state);
}

void Subscription::OfferPresence(std::shared_ptr<const v1::PresenceEvent> presence) {
  if (presence == presence_seen_) return;
  presence_seen_ = presence;
  presence_ = std::move(presence);
}

void Subscription::OfferChat(std::shared_ptr<const ChatLog> log) {
  if (chat_ == nullptr && !log->empty()) chat_sent_ = log->back()->number();
  chat_ = std::move(log);
}

void Subscription::OfferVoice(const VoiceBatch& batch) {
  if (Has(v1::TOPIC_VOICE)) voice_.Push(batch);
}

void Subscription::OfferPicturePause(std::shared_ptr<const PicturePause> state) {
  if (state == pause_) return;
  pause_ = std::move(state);
  pause_due_ = true;
  if (pause_->paused) video_.RequireKeyFrame();
}

absl::Status Subscription::Acknowledge(std::uint64_t sequence, bool request_key_frame,
                                       Timestamp now_ns) {
  if (sequence > sequence_) {
    return absl::InvalidArgumentError(
        absl::StrCat("sequence: ", sequence, " was not sent yet; the last one is ", sequence_));
  }
  if (sequence > acknowledged_) {
    acknowledged_ = sequence;
    unacknowledged_since_ = now_ns;
    if (acknowledged_ == sequence_) unacknowledged_since_.reset();
  }
  if (request_key_frame) video_.RequireKeyFrame();
  return absl::OkStatus();
}

bool Subscription::WantsKeyFrame(Timestamp now_ns) {
  if (pause_ && pause_->paused) return false;
  return Has(v1::TOPIC_VIDEO) && WindowOpen() && video_.WantsKeyFrame(now_ns);
}

bool Subscription::Next(Timestamp now_ns, EncodedEvent& event) {
  std::optional<Payload> payload;
  if (WindowOpen(kVoiceBeyond)) payload = FillVoice();
  for (int turn = 1; !payload && WindowOpen() && turn <= kKinds; ++turn) {
    const int kind = (last_kind_ + turn) % kKinds;
    payload = Fill(static_cast<Kind>(kind), now_ns);
    if (payload) last_kind_ = kind;
  }
  if (!payload) return false;
  event = EncodedEvent::Of(++sequence_, payload->field, std::move(payload->bytes),
                           std::move(payload->tail));
  if (!unacknowledged_since_) unacknowledged_since_ = now_ns;
  return true;
}

std::optional<Subscription::Payload> Subscription::Fill(Kind kind, Timestamp now_ns) {
  switch (kind) {
    case kAnnotations:
      return FillAnnotations();
    case kMap:
      return FillMap();
    case kPresence:
      if (!Has(v1::TOPIC_PRESENCE) || presence_ == nullptr) return std::nullopt;
      return Payload{v1::Event::kPresenceFieldNumber,
                     bytes_->Presence(std::exchange(presence_, {}))};
    case kGaze:
      if (!Has(v1::TOPIC_GAZE) || gaze_ == nullptr) return std::nullopt;
      return Payload{v1::Event::kGazeFieldNumber, bytes_->Gaze(std::exchange(gaze_, {}))};
    case kPicturePause:
      if (!Has(v1::TOPIC_PICTURE_PAUSE) || !std::exchange(pause_due_, false)) return std::nullopt;
      return Payload{v1::Event::kPicturePauseFieldNumber, Serialized(PicturePauseToProto(*pause_))};
    case kChat:
      return FillChat();
    case kPose:
      if (!Has(v1::TOPIC_POSE) || !std::exchange(pose_due_, false)) return std::nullopt;
      return Payload{v1::Event::kPoseFieldNumber, bytes_->Pose(state_->tracked)};
    case kVideo:
      return FillVideo(now_ns);
    case kStatistics:
      if (!Has(v1::TOPIC_STATISTICS) || !statistics_) return std::nullopt;
      return Payload{v1::Event::kStatisticsFieldNumber,
                     Serialized(StatisticsToProto(*std::exchange(statistics_, std::nullopt),
                                                  video_.skipped() + poses_skipped_))};
    case kPointers:
      return FillPointers();
    case kScene:
      return FillScene();
    case kSurface:
      return FillSurface();
    case kEnd: {
      if (!end_frames_) return std::nullopt;
      v1::EndOfSource end;
      end.set_frames(*std::exchange(end_frames_, std::nullopt));
      return Payload{v1::Event::kEndOfSourceFieldNumber, Serialized(end)};
    }
    case kKinds:
      break;
  }
  return std::nullopt;
}

// The parts of a large state follow at once, in turn with the other kinds. Who had the same state
// before is sent the same.
std::optional<Subscription::Payload> Subscription::FillAnnotations() {
  if (!Has(v1::TOPIC_ANNOTATION) || !std::exchange(annotations_due_, false)) return std::nullopt;
  const Bytes bytes = bytes_->Annotations(*state_, annotations_);
  annotations_due_ = !annotations_.complete();
  if (bytes == nullptr) return std::nullopt;
  return Payload{v1::Event::kAnnotationFieldNumber, bytes};
}

std::optional<Subscription::Payload> Subscription::FillMap() {
  if (!Has(v1::TOPIC_MAP) || !std::exchange(map_due_, false)) return std::nullopt;
  const Bytes bytes = bytes_->Map(*state_, map_);
  map_due_ = !map_.complete();
  if (bytes == nullptr) return std::nullopt;
  return Payload{v1::Event::kMapFieldNumber, bytes};
}

std::optional<Subscription::Payload> Subscription::FillVideo(Timestamp now_ns) {
  if (!Has(v1::TOPIC_VIDEO)) return std::nullopt;
  const std::shared_ptr<const VideoPacket> packet = video_.Take(now_ns);
  if (packet == nullptr) return std::nullopt;
  return Payload{v1::Event::kAccessUnitFieldNumber, bytes_->AccessUnit(packet, Has(v1::TOPIC_MAP)),
                 QueuedStage(now_ns)};
}

// Nobody shares it: each has heard something else of a stroke.
std::optional<Subscription::Payload> Subscription::FillPointers() {
  if (!Has(v1::TOPIC_POINTER) || !std::exchange(pointers_due_, false)) return std::nullopt;
  v1::PointerEvent event;
  const bool any = pointer_reader_.Next(*pointers_, event);
  pointers_due_ = !pointer_reader_.complete();
  if (!any) return std::nullopt;
  return Payload{v1::Event::kPointerFieldNumber, Serialized(event)};
}

// Nobody shares it: it is rare.
std::optional<Subscription::Payload> Subscription::FillScene() {
  if (!Has(v1::TOPIC_SCENE) || scene_ == nullptr) return std::nullopt;
  const SceneLight light = state_ ? state_->tracked.light : SceneLight();
  if (!std::exchange(scene_due_, false) && !scene_reader_.IsOther(light)) return std::nullopt;
  v1::SceneEvent event;
  if (!scene_reader_.Next(scene_, light, event)) return std::nullopt;
  return Payload{v1::Event::kSceneFieldNumber, Serialized(event)};
}

// Who is behind gets it in parts; what is no longer kept is left out.
std::optional<Subscription::Payload> Subscription::FillSurface() {
  if (!Has(v1::TOPIC_SURFACE) || !std::exchange(surface_due_, false)) return std::nullopt;
  v1::SurfaceEvent event;
  event.set_edition(surface_.first);
  event.set_version(surface_.second);
  return Payload{v1::Event::kSurfaceFieldNumber, Serialized(event)};
}

std::optional<Subscription::Payload> Subscription::FillChat() {
  if (!Has(v1::TOPIC_CHAT) || chat_ == nullptr) return std::nullopt;
  const auto first = After(*chat_, chat_sent_);
  if (first == chat_->end()) return std::nullopt;
  v1::ChatEvent event;
  for (auto at = first; at != chat_->end() && at - first < kMessagesOfEvent; ++at) {
    *event.add_messages() = **at;
    chat_sent_ = (*at)->number();
  }
  return Payload{v1::Event::kChatFieldNumber, Serialized(event)};
}

std::optional<Subscription::Payload> Subscription::FillVoice() {
  v1::VoiceEvent event;
  if (!voice_.Take(event)) return std::nullopt;
  return Payload{v1::Event::kVoiceFieldNumber, Serialized(event)};
}

v1::PicturePause PicturePauseToProto(const PicturePause& state) {
  v1::PicturePause message;
  message.set_paused(state.paused);
  message.set_by(state.by);
  message.set_since_unix_ns(state.since_unix_ns);
  return message;
}

v1::StatisticsEvent StatisticsToProto(const EngineStatistics& statistics,
                                      std::uint64_t events_skipped) {
  v1::StatisticsEvent event;
  event.set_captured_fps_hz(statistics.captured_fps);
  event.set_tracked_fps_hz(statistics.tracked_fps);
  event.set_encoded_fps_hz(statistics.encoded_fps);
  event.set_frames_dropped(statistics.frames_dropped);
  event.set_bad_frames(statistics.bad_frames);
  event.set_events_skipped(events_skipped);
  event.set_video_bit_rate_bit_s(statistics.video_bit_rate_bit_s);
  event.set_track_ms_p50(statistics.track_ms_p50);
  event.set_track_ms_p95(statistics.track_ms_p95);
  event.set_encode_ms_p50(statistics.encode_ms_p50);
  event.set_encode_ms_p95(statistics.encode_ms_p95);
  return event;
}

}  // namespace saccade
