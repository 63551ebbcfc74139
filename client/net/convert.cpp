#include "client/net/convert.hpp"

#include <absl/strings/str_cat.h>

#include <iterator>
#include <utility>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::net {
namespace {

Role RoleFromProto(v1::Role role) {
  switch (role) {
    case v1::ROLE_EXPERT:
      return Role::kExpert;
    case v1::ROLE_WEARER:
      return Role::kWearer;
    default:
      return Role::kViewer;
  }
}

// A server that has seen no frame yet sends no pose.
absl::StatusOr<MapSnapshot> PoseOrNone(bool present, const v1::PoseEvent& message) {
  if (!present) return MapSnapshot{};
  return wire::FromProto(message, "pose");
}

}  // namespace

v1::Role ToProto(Role role) {
  switch (role) {
    case Role::kExpert:
      return v1::ROLE_EXPERT;
    case Role::kWearer:
      return v1::ROLE_WEARER;
    case Role::kViewer:
      return v1::ROLE_VIEWER;
  }
  return v1::ROLE_UNSPECIFIED;
}

v1::VideoView ToProto(VideoView view) {
  return view == VideoView::kRaw ? v1::VIDEO_VIEW_RAW : v1::VIDEO_VIEW_AUGMENTED;
}

v1::AnnotationDraft ToProto(const AnnotationDraft& draft) {
  v1::AnnotationDraft message;
  message.set_shape(wire::ToProto(draft.shape));
  message.set_text(draft.text);
  message.set_size_m(draft.size_m);
  message.set_color_rgba(draft.color_rgba);
  *message.mutable_target() = wire::ToProto(draft.target);
  for (const Eigen::Vector2d& pixel : draft.ink_px) *message.add_ink_px() = wire::ToProto(pixel);
  for (const Eigen::Vector3d& offset : draft.ink_offset_m) {
    *message.add_ink_offset_m() = wire::ToProto(offset);
  }
  if (draft.end_target) *message.mutable_end_target() = wire::ToProto(*draft.end_target);
  if (draft.world_from_mark) {
    *message.mutable_world_from_mark() = wire::ToProto(*draft.world_from_mark);
  }
  if (draft.extent_m) *message.mutable_extent_m() = wire::ToProto(*draft.extent_m);
  if (draft.picture) message.set_picture(draft.picture->bytes);
  for (const std::string& item : draft.check_items) message.add_check_items(item);
  return message;
}

Statistics FromProto(const v1::StatisticsEvent& message) {
  return {.captured_fps_hz = message.captured_fps_hz(),
          .tracked_fps_hz = message.tracked_fps_hz(),
          .encoded_fps_hz = message.encoded_fps_hz(),
          .frames_dropped = message.frames_dropped(),
          .bad_frames = message.bad_frames(),
          .events_skipped = message.events_skipped(),
          .video_bit_rate_bit_s = message.video_bit_rate_bit_s(),
          .track_ms_p50 = message.track_ms_p50(),
          .track_ms_p95 = message.track_ms_p95(),
          .encode_ms_p50 = message.encode_ms_p50(),
          .encode_ms_p95 = message.encode_ms_p95()};
}

std::vector<Participant> FromProto(const v1::PresenceEvent& message) {
  std::vector<Participant> participants;
  for (const v1::Participant& participant : message.participants()) {
    participants.push_back({.participant_id = participant.participant_id(),
                            .display_name = participant.display_name(),
                            .role = RoleFromProto(participant.role())});
  }
  return participants;
}

PicturePause FromProto(const v1::PicturePause& message) {
  return {message.paused(), message.by(), message.since_unix_ns()};
}

ChatMessage FromProto(const v1::ChatMessage& message) {
  return {message.number(), message.participant_id(), message.display_name(),
          message.text(),   message.annotation_id(),  message.sent_unix_ns()};
}

std::vector<ChatMessage> FromProto(
    const google::protobuf::RepeatedPtrField<v1::ChatMessage>& messages) {
  std::vector<ChatMessage> all;
  for (const v1::ChatMessage& message : messages) all.push_back(FromProto(message));
  return all;
}

absl::StatusOr<ServerStatus> FromProto(const v1::GetStatusResponse& message) {
  absl::StatusOr<MapSnapshot> pose = PoseOrNone(message.has_pose(), message.pose());
  if (!pose.ok()) return pose.status();
  return ServerStatus{.pose = *std::move(pose),
                      .statistics = FromProto(message.statistics()),
                      .participants = FromProto(message.presence()),
                      .map_features = message.map_features(),
                      .annotations = message.annotations(),
                      .source = message.source(),
                      .server_version = message.server_version(),
                      .uptime_s = message.uptime_s(),
                      .source_ended = message.source_ended(),
                      .picture_pause = FromProto(message.picture_pause())};
}

absl::StatusOr<MapState> FromProto(const v1::GetMapResponse& message) {
  const v1::MapDelta& map = message.map();
  MapState state{.generation = map.map_generation(),
                 .revision = map.map_revision(),
                 .frame_id = map.frame_id(),
                 .metric = message.metric(),
                 .complete = !map.more(),
                 .features = {}};
  for (int i = 0; i < map.upserted_size(); ++i) {
    absl::StatusOr<FeatureSnapshot> feature =
        wire::FromProto(map.upserted(i), absl::StrCat("map.upserted[", i, "]"));
    if (!feature.ok()) return feature.status();
    state.features.push_back(*std::move(feature));
  }
  return state;
}

absl::StatusOr<Still> FromProto(const v1::GetFrameResponse& message) {
  absl::StatusOr<MapSnapshot> pose = PoseOrNone(message.has_pose(), message.pose());
  if (!pose.ok()) return pose.status();
  absl::StatusOr<CameraIntrinsics> intrinsics = wire::FromProto(message.intrinsics(), "intrinsics");
  if (!intrinsics.ok()) return intrinsics.status();
  return Still{.frame_id = message.frame_id(),
               .png = message.png(),
               .intrinsics = *intrinsics,
               .pose = *std::move(pose)};
}

absl::StatusOr<std::vector<Annotation>> FromProto(
    const google::protobuf::RepeatedPtrField<v1::Annotation>& messages) {
  std::vector<Annotation> annotations;
  for (int i = 0; i < messages.size(); ++i) {
    absl::StatusOr<Annotation> annotation =
        wire::FromProto(messages[i], absl::StrCat("annotations[", i, "]"));
    if (!annotation.ok()) return annotation.status();
    annotations.push_back(*std::move(annotation));
  }
  return annotations;
}

absl::StatusOr<AnnotationChange> FromProto(const v1::AnnotationEvent& message) {
  absl::StatusOr<std::vector<Annotation>> upserted = FromProto(message.upserted());
  if (!upserted.ok()) return upserted.status();
  AnnotationChange change{
      .full = message.full(),
      .upserted = *std::move(upserted),
      .removed_ids = {message.removed_ids().begin(), message.removed_ids().end()},
      .anchors = {}};
  for (int i = 0; i < message.anchors_size(); ++i) {
    absl::StatusOr<Anchor> anchor =
        wire::FromProto(message.anchors(i).anchor(), absl::StrCat("anchors[", i, "].anchor"));
    if (!anchor.ok()) return anchor.status();
    change.anchors.push_back({message.anchors(i).id(), *std::move(anchor)});
  }
  return change;
}

std::optional<AnnotationChange> AnnotationParts::Add(AnnotationChange part, bool more) {
  const auto append = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  if (!so_far_ || part.full) {
    so_far_ = std::move(part);
  } else {
    append(so_far_->upserted, part.upserted);
    append(so_far_->removed_ids, part.removed_ids);
    append(so_far_->anchors, part.anchors);
  }
  if (more) return std::nullopt;
  return std::exchange(so_far_, std::nullopt);
}

absl::StatusOr<std::optional<WatchEvent>> FromProto(const v1::Event& message) {
  switch (message.event_case()) {
    case v1::Event::kPose: {
      absl::StatusOr<MapSnapshot> pose = wire::FromProto(message.pose(), "pose");
      if (!pose.ok()) return pose.status();
      return WatchEvent{*std::move(pose)};
    }
    case v1::Event::kAnnotation: {
      absl::StatusOr<AnnotationChange> change = FromProto(message.annotation());
      if (!change.ok()) return change.status();
      return WatchEvent{*std::move(change)};
    }
    case v1::Event::kStatistics:
      return WatchEvent{FromProto(message.statistics())};
    case v1::Event::kPresence:
      return WatchEvent{FromProto(message.presence())};
    case v1::Event::kEndOfSource:
      return WatchEvent{SourceEnd{message.end_of_source().frames()}};
    default:
      return std::optional<WatchEvent>();
  }
}

}  // namespace saccade::net
