#include "server/record/replayed_state.hpp"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "foxglove/schemas.pb.h"
#include "saccade/v1/session.pb.h"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/gaze.hpp"
#include "shared/wire/scene.hpp"
#include "shared/wire/surface.hpp"

namespace saccade {
namespace {

constexpr double kSixteenth = 1.0 / 16.0;  // FrameFeatures [px]

absl::Status Unreadable(absl::string_view topic, absl::string_view why) {
  return absl::DataLossError(absl::StrCat(topic, ": a message is not as this version writes it",
                                          why.empty() ? "" : ": ", why));
}

template <typename Message>
absl::Status ParseInto(const McapReader::Message& from, Message& message) {
  if (message.ParseFromArray(from.data.data(), static_cast<int>(from.data.size()))) {
    return absl::OkStatus();
  }
  return Unreadable(from.topic, "");
}

/// Ids with where they are in the picture.
using Seen = absl::flat_hash_map<FeatureId, Eigen::Vector2d>;

Seen SeenIn(const google::protobuf::RepeatedField<std::uint64_t>& ids,
            const google::protobuf::RepeatedField<std::int32_t>& px16) {
  Seen seen;
  for (int i = 0; i < ids.size() && 2 * i + 1 < px16.size(); ++i) {
    seen[ids[i]] = {kSixteenth * px16[2 * i], kSixteenth * px16[2 * i + 1]};
  }
  return seen;
}

void Mark(const v1::FrameFeatures& frame, std::vector<FeatureSnapshot>& features) {
  const Seen measured = SeenIn(frame.measured_ids(), frame.measured_px16());
  const Seen failed = SeenIn(frame.failed_ids(), frame.failed_px16());
  for (FeatureSnapshot& feature : features) {
    const auto hit = measured.find(feature.id), miss = failed.find(feature.id);
    feature.state = hit != measured.end()  ? FeatureState::kMeasured
                    : miss != failed.end() ? FeatureState::kFailed
                                           : FeatureState::kNotAttempted;
    if (hit != measured.end()) feature.pixel = hit->second;
    if (miss != failed.end()) feature.pixel = miss->second;
  }
}

}  // namespace

void ReplayedState::Restart() {
  features_.clear();
  by_id_.clear();
  annotations_ = std::make_shared<const AnnotationList>();
  ForgetSurface();
  picture_.reset();
  newest_.reset();
  first_id_ = last_id_ + 1;
  ++generation_;
}

absl::StatusOr<TrackedEvent> ReplayedState::EventOf(const v1::PoseEvent& pose) const {
  absl::StatusOr<MapSnapshot> read = wire::FromProto(pose, "pose");
  if (!read.ok()) return Unreadable("/saccade/pose", read.status().message());
  auto snapshot = std::make_shared<MapSnapshot>(*std::move(read));
  snapshot->frame_id += first_id_;
  snapshot->capture_time_ns = now_ns_;
  snapshot->map_generation = generation_;
  snapshot->features.reserve(features_.size());
  for (const auto& [id, feature] : features_) snapshot->features.push_back(feature);
  TrackedEvent event;
  event.stages.captured_ns = event.stages.received_ns = event.stages.tracked_ns =
      snapshot->capture_time_ns;
  event.snapshot = std::move(snapshot);
  event.annotations = annotations_;
  event.camera = camera_;
  auto markers = std::make_shared<std::vector<MarkerPose>>();
  for (const v1::MarkerPose& message : pose.markers()) {
    auto marker = wire::FromProto(message, "markers");
    if (marker.ok()) markers->push_back(*std::move(marker));
  }
  if (!markers->empty()) event.markers = std::move(markers);
  return event;
}

absl::Status ReplayedState::TakePose(const McapReader::Message& message, EventSink* sink) {
  v1::PoseEvent pose;
  if (absl::Status parsed = ParseInto(message, pose); !parsed.ok()) return parsed;
  if (camera_ == nullptr) return absl::OkStatus();  // the first picture says with what lens
  absl::StatusOr<TrackedEvent> event = EventOf(pose);
  if (!event.ok()) return event.status();
  last_id_ = std::max(last_id_, event->snapshot->frame_id);
  newest_ = *std::move(event);
  if (sink != nullptr) sink->OnTracked(*newest_);
  return absl::OkStatus();
}

void ReplayedState::TellAgain(EventSink& sink) {
  if (!newest_) return;
  auto snapshot = std::make_shared<MapSnapshot>(*newest_->snapshot);
  // Ids of what follows are counted from here.
  first_id_ += 1;
  snapshot->frame_id = last_id_ += 1;
  snapshot->capture_time_ns = now_ns_;
  newest_->stages.captured_ns = newest_->stages.received_ns = newest_->stages.tracked_ns = now_ns_;
  newest_->snapshot = std::move(snapshot);
  sink.OnTracked(*newest_);
}

absl::Status ReplayedState::TakePicture(const McapReader::Message& message) {
  picture_.emplace();
  if (absl::Status parsed = ParseInto(message, *picture_); !parsed.ok()) return parsed;
  std::string bytes = picture_->intrinsics().SerializeAsString();
  if (camera_ != nullptr && bytes == lens_) return absl::OkStatus();
  const auto lens = wire::FromProto(picture_->intrinsics(), "intrinsics");
  if (!lens.ok()) return Unreadable(message.topic, lens.status().message());
  lens_ = std::move(bytes);
  camera_ = std::make_shared<const CameraModel>(*lens);
  return absl::OkStatus();
}

absl::Status ReplayedState::TakeVideo(const McapReader::Message& message, EventSink* sink) {
  if (!picture_) return absl::OkStatus();  // of a picture that was before
  const v1::AccessUnit facts = *std::exchange(picture_, std::nullopt);
  foxglove::CompressedVideo video;
  if (absl::Status parsed = ParseInto(message, video); !parsed.ok()) return parsed;
  absl::StatusOr<TrackedEvent> event = EventOf(facts.pose());
  if (!event.ok()) return event.status();
  auto snapshot = std::make_shared<MapSnapshot>(*event->snapshot);
  Mark(facts.features(), snapshot->features);
  event->snapshot = std::move(snapshot);
  event->stages.encoded_ns = event->stages.captured_ns;
  last_id_ = std::max(last_id_, event->snapshot->frame_id);
  auto packet = std::make_shared<VideoPacket>();
  packet->view = VideoView::kRaw;
  packet->sequence = sequence_++;
  packet->key_frame = facts.key_frame();
  packet->temporal_layer = static_cast<int>(facts.temporal_layer());
  packet->data = std::make_shared<const std::string>(std::move(*video.mutable_data()));
  packet->width = static_cast<int>(facts.intrinsics().width_px());
  packet->height = static_cast<int>(facts.intrinsics().height_px());
  packet->tracked = *std::move(event);
  if (sink != nullptr) sink->OnVideo(packet);
  return absl::OkStatus();
}

absl::Status ReplayedState::TakeMap(const McapReader::Message& message) {
  v1::MapDelta delta;
  if (absl::Status parsed = ParseInto(message, delta); !parsed.ok()) return parsed;
  if (delta.full()) features_.clear();
  if (delta.map_generation() != recorded_generation_) {  // thrown away: other ids
    recorded_generation_ = delta.map_generation();
    ++generation_;
  }
  for (const v1::Feature& each : delta.upserted()) {
    absl::StatusOr<FeatureSnapshot> feature = wire::FromProto(each, "upserted");
    if (!feature.ok()) return Unreadable(message.topic, feature.status().message());
    features_[feature->id] = *std::move(feature);
  }
  for (const std::uint64_t id : delta.removed_ids()) features_.erase(id);
  return absl::OkStatus();
}

absl::Status ReplayedState::TakeAnnotations(const McapReader::Message& message) {
  v1::AnnotationEvent event;
  if (absl::Status parsed = ParseInto(message, event); !parsed.ok()) return parsed;
  if (event.full()) by_id_.clear();
  for (const v1::Annotation& each : event.upserted()) {
    absl::StatusOr<Annotation> annotation = wire::FromProto(each, "upserted");
    if (!annotation.ok()) return Unreadable(message.topic, annotation.status().message());
    by_id_[annotation->id] = *std::move(annotation);
  }
  for (const v1::AnchorUpdate& each : event.anchors()) {
    const auto found = by_id_.find(each.id());
    auto anchor = wire::FromProto(each.anchor(), "anchors");
    if (!anchor.ok()) return Unreadable(message.topic, anchor.status().message());
    if (found != by_id_.end()) found->second.anchor = *std::move(anchor);
  }
  for (const std::string& id : event.removed_ids()) by_id_.erase(id);
  auto list = std::make_shared<AnnotationList>();
  for (const auto& [id, annotation] : by_id_) list->push_back(annotation);
  annotations_ = std::move(list);
  return absl::OkStatus();
}

void ReplayedState::ForgetSurface() {
  auto none = std::make_shared<SurfaceSnapshot>();
  none->edition = ++surface_edition_;
  surface_ = std::move(none);
}

absl::Status ReplayedState::TakeSurface(const McapReader::Message& message, EventSink* sink) {
  v1::GetSurfaceResponse recorded;
  if (absl::Status parsed = ParseInto(message, recorded); !parsed.ok()) return parsed;
  if (recorded.edition() != recorded_edition_) ForgetSurface();
  recorded_edition_ = recorded.edition();
  auto surface = std::make_shared<SurfaceSnapshot>(*surface_);
  surface->generation = generation_;
  for (const v1::SurfaceChunk& each : recorded.chunks()) {
    absl::StatusOr<SurfaceChunk> chunk = wire::FromProto(each);
    if (!chunk.ok()) return Unreadable(message.topic, chunk.status().message());
    const auto before = surface->chunks.find(chunk->index);
    if (before != surface->chunks.end() && before->second->positions == chunk->positions &&
        before->second->colors_rgb == chunk->colors_rgb) {
      continue;  // told again for who begins there
    }
    chunk->version = ++surface->version;
    surface->chunks[chunk->index] = std::make_shared<const SurfaceChunk>(*std::move(chunk));
  }
  surface_ = std::move(surface);
  if (sink != nullptr) sink->OnSurface(surface_);
  return absl::OkStatus();
}

absl::Status ReplayedState::Take(const McapReader::Message& message, EventSink* sink) {
  if (message.topic == "/saccade/pose") return TakePose(message, sink);
  if (message.topic == "/saccade/picture") return TakePicture(message);
  if (message.topic == "/camera/video") return TakeVideo(message, sink);
  if (message.topic == "/saccade/map") return TakeMap(message);
  if (message.topic == "/saccade/annotations") return TakeAnnotations(message);
  if (message.topic == "/saccade/surface") return TakeSurface(message, sink);
  if (message.topic != "/saccade/gaze") return absl::OkStatus();
  v1::GazeState state;
  if (absl::Status parsed = ParseInto(message, state); !parsed.ok()) return parsed;
  absl::StatusOr<GazeSnapshot> gaze = wire::FromProto(state, "gaze");
  if (!gaze.ok()) return Unreadable(message.topic, gaze.status().message());
  gaze_ = std::make_shared<const GazeSnapshot>(*std::move(gaze));
  if (sink != nullptr) sink->OnGaze(gaze_);
  return absl::OkStatus();
}

}  // namespace saccade
