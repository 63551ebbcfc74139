#include "server/rpc/subscription.hpp"

#include <absl/strings/str_cat.h>

#include "shared/wire/gaze.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

constexpr std::uint32_t kDefaultWindow = 32;
constexpr std::uint32_t kMaxWindow = 256;

v1::AccessUnit AccessUnitToProto(const VideoPacket& packet, Timestamp now_ns) {
  v1::AccessUnit unit;
  const TrackedEvent& tracked = packet.tracked;
  unit.set_frame_id(tracked.snapshot->frame_id);
  unit.set_view(packet.view == VideoView::kRaw ? v1::VIDEO_VIEW_RAW : v1::VIDEO_VIEW_AUGMENTED);
  unit.set_codec(v1::VIDEO_CODEC_H264);
  unit.set_key_frame(packet.key_frame);
  unit.set_temporal_layer(static_cast<std::uint32_t>(packet.temporal_layer));
  unit.set_data(*packet.data);
  CameraIntrinsics coded = tracked.camera->intrinsics();
  coded.width = packet.width;
  coded.height = packet.height;
  *unit.mutable_intrinsics() = wire::ToProto(coded);
  *unit.mutable_pose() = wire::ToProtoPose(*tracked.snapshot, tracked.stages.captured_ns);
  v1::StageTimestamps& stages = *unit.mutable_stages();
  stages.set_captured_ns(tracked.stages.captured_ns);
  stages.set_received_ns(tracked.stages.received_ns);
  stages.set_tracked_ns(tracked.stages.tracked_ns);
  stages.set_encoded_ns(tracked.stages.encoded_ns);
  stages.set_queued_ns(now_ns);
  return unit;
}

}  // namespace

absl::StatusOr<SubscriptionOptions> SubscriptionOptions::FromProto(
    const v1::SubscribeRequest& request) {
  SubscriptionOptions options;
  if (request.topics().empty()) options.topics.set();
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

void Subscription::Offer(const NumberedState& state) {
  // Between frames the annotations alone change: the pose is known already.
  const bool same_frame = state_ && state_->tracked.snapshot == state.tracked.snapshot;
  state_ = state;
  annotations_due_ = true;
  if (same_frame) return;
  if (pose_due_ && Has(v1::TOPIC_POSE)) ++poses_skipped_;
  pose_due_ = map_due_ = true;
}

void Subscription::Offer(const std::shared_ptr<const VideoPacket>& packet) {
  if (Has(v1::TOPIC_VIDEO) && packet->view == options_.view) video_.Push(packet);
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
  return Has(v1::TOPIC_VIDEO) && WindowOpen() && video_.WantsKeyFrame(now_ns);
}

bool Subscription::Next(Timestamp now_ns, v1::Event& event) {
  if (!WindowOpen()) return false;
  for (int turn = 1; turn <= kKinds; ++turn) {
    const int kind = (last_kind_ + turn) % kKinds;
    event.Clear();
    if (!Fill(static_cast<Kind>(kind), now_ns, event)) continue;
    event.set_sequence(++sequence_);
    if (!unacknowledged_since_) unacknowledged_since_ = now_ns;
    last_kind_ = kind;
    return true;
  }
  return false;
}

bool Subscription::Fill(Kind kind, Timestamp now_ns, v1::Event& event) {
  switch (kind) {
    case kAnnotations:
      return Has(v1::TOPIC_ANNOTATION) && FillAnnotations(event);
    case kMap:
      return Has(v1::TOPIC_MAP) && FillMap(event);
    case kPresence:
      if (!Has(v1::TOPIC_PRESENCE) || presence_ == nullptr) return false;
      *event.mutable_presence() = *std::exchange(presence_, nullptr);
      return true;
    case kGaze:
      if (!Has(v1::TOPIC_GAZE) || gaze_ == nullptr) return false;
      *event.mutable_gaze() = wire::ToProto(*std::exchange(gaze_, nullptr));
      return true;
    case kPose:
      return FillPose(event);
    case kVideo:
      return FillVideo(now_ns, event);
    case kStatistics:
      return FillStatistics(event);
    case kEnd:
      if (!end_frames_) return false;
      event.mutable_end_of_source()->set_frames(*std::exchange(end_frames_, std::nullopt));
      return true;
    case kKinds:
      break;
  }
  return false;
}

// The parts of a large state follow at once, in turn with the other kinds.
bool Subscription::FillAnnotations(v1::Event& event) {
  if (!annotations_due_) return false;
  const bool filled = annotations_.Next(*state_, *event.mutable_annotation());
  annotations_due_ = event.annotation().more();
  return filled;
}

bool Subscription::FillMap(v1::Event& event) {
  if (!map_due_) return false;
  const bool filled = map_.Next(*state_, *event.mutable_map());
  map_due_ = event.map().more();
  return filled;
}

bool Subscription::FillPose(v1::Event& event) {
  if (!Has(v1::TOPIC_POSE) || !std::exchange(pose_due_, false)) return false;
  const TrackedEvent& tracked = state_->tracked;
  *event.mutable_pose() = wire::ToProtoPose(*tracked.snapshot, tracked.stages.captured_ns);
  return true;
}

bool Subscription::FillVideo(Timestamp now_ns, v1::Event& event) {
  if (!Has(v1::TOPIC_VIDEO)) return false;
  const std::shared_ptr<const VideoPacket> packet = video_.Take(now_ns);
  if (packet == nullptr) return false;
  v1::AccessUnit& unit = *event.mutable_access_unit() = AccessUnitToProto(*packet, now_ns);
  // Of the packet's own frame, not of the newest: a dot belongs to the picture it was measured in.
  if (Has(v1::TOPIC_MAP)) {
    *unit.mutable_features() = wire::ToProtoFeatures(*packet->tracked.snapshot);
  }
  return true;
}

bool Subscription::FillStatistics(v1::Event& event) {
  if (!Has(v1::TOPIC_STATISTICS) || !statistics_) return false;
  *event.mutable_statistics() = StatisticsToProto(*std::exchange(statistics_, std::nullopt),
                                                  video_.skipped() + poses_skipped_);
  return true;
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
