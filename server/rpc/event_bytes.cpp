#include "server/rpc/event_bytes.hpp"

#include <google/protobuf/io/coded_stream.h>

#include <algorithm>
#include <utility>

#include "shared/wire/gaze.hpp"
#include "shared/wire/scene.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

constexpr std::uint32_t kVarint = 0, kLengthDelimited = 2;

void AppendVarint(std::uint64_t value, std::string& out) {
  std::uint8_t buffer[10];
  const std::uint8_t* end =
      google::protobuf::io::CodedOutputStream::WriteVarint64ToArray(value, buffer);
  out.append(reinterpret_cast<const char*>(buffer), static_cast<std::size_t>(end - buffer));
}

v1::PoseEvent PoseToProto(const TrackedEvent& tracked) {
  v1::PoseEvent pose = wire::ToProtoPose(*tracked.snapshot, tracked.stages.captured_ns);
  if (tracked.markers == nullptr) return pose;
  for (const MarkerPose& marker : *tracked.markers) *pose.add_markers() = wire::ToProto(marker);
  return pose;
}

v1::AccessUnit AccessUnitToProto(const VideoPacket& packet, bool features) {
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
  *unit.mutable_pose() = PoseToProto(tracked);
  v1::StageTimestamps& stages = *unit.mutable_stages();
  stages.set_captured_ns(tracked.stages.captured_ns);
  stages.set_received_ns(tracked.stages.received_ns);
  stages.set_tracked_ns(tracked.stages.tracked_ns);
  stages.set_encoded_ns(tracked.stages.encoded_ns);
  // Of the packet's own frame, not of the newest: a dot belongs to the picture it was measured in.
  if (features) *unit.mutable_features() = wire::ToProtoFeatures(*tracked.snapshot);
  return unit;
}

}  // namespace

EncodedEvent EncodedEvent::Of(std::uint64_t sequence, int field, Bytes payload, std::string tail) {
  EncodedEvent event;
  AppendVarint(v1::Event::kSequenceFieldNumber << 3 | kVarint, event.head);
  AppendVarint(sequence, event.head);
  AppendVarint(static_cast<std::uint64_t>(field) << 3 | kLengthDelimited, event.head);
  AppendVarint(payload->size() + tail.size(), event.head);
  event.shared = std::move(payload);
  event.tail = std::move(tail);
  return event;
}

Bytes EventBytes::Memory::Get(const Key& key, const std::function<Bytes()>& make) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(kept_.begin(), kept_.end(),
                                  [&key](const auto& one) { return one.first == key; });
  if (found != kept_.end()) return found->second;
  Bytes bytes = make();
  if (kept_.size() >= kKept) kept_.erase(kept_.begin());
  kept_.emplace_back(key, bytes);
  return bytes;
}

Bytes EventBytes::AccessUnit(const std::shared_ptr<const VideoPacket>& packet, bool features) {
  return units_.Get({packet, features}, [&] {
    return std::make_shared<const std::string>(
        AccessUnitToProto(*packet, features).SerializeAsString());
  });
}

Bytes EventBytes::Pose(const TrackedEvent& tracked) {
  return poses_.Get({tracked.snapshot, 0}, [&] {
    return std::make_shared<const std::string>(PoseToProto(tracked).SerializeAsString());
  });
}

Bytes EventBytes::Presence(const std::shared_ptr<const v1::PresenceEvent>& presence) {
  return presence_.Get({presence, 0}, [&] {
    return std::make_shared<const std::string>(presence->SerializeAsString());
  });
}

Bytes EventBytes::Gaze(const std::shared_ptr<const GazeSnapshot>& state) {
  return gaze_.Get({state, 0}, [&] {
    return std::make_shared<const std::string>(wire::ToProto(*state).SerializeAsString());
  });
}

template <typename Reader>
template <typename Message>
Bytes EventBytes::Ways<Reader>::Next(const std::shared_ptr<const void>& to,
                                     const NumberedState& state, Reader& reader) {
  const auto make = [&]() -> Bytes {
    Message message;
    if (!reader.Next(state, message)) return nullptr;
    return std::make_shared<const std::string>(message.SerializeAsString());
  };
  if (!reader.complete()) return make();  // begins, or is between two parts: nobody else is there
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Way& way) {
    return way.to == to && way.before == reader;
  });
  if (found != kept_.end()) {
    reader = found->after;
    return found->bytes;
  }
  const Reader before = reader;
  Bytes bytes = make();
  if (kept_.size() >= kKept) kept_.erase(kept_.begin());
  kept_.push_back({to, before, reader, bytes});
  return bytes;
}

Bytes EventBytes::Map(const NumberedState& state, MapReader& reader) {
  return map_.Next<v1::MapDelta>(state.map, state, reader);
}

Bytes EventBytes::Annotations(const NumberedState& state, AnnotationReader& reader) {
  return annotations_.Next<v1::AnnotationEvent>(state.annotations, state, reader);
}

}  // namespace saccade
