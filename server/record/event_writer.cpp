#include "server/record/event_writer.hpp"

#include <absl/strings/str_cat.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <array>
#include <set>
#include <string>
#include <utility>

#include "foxglove/schemas.pb.h"

namespace saccade {
namespace {

constexpr Timestamp kSecond_ns = 1'000'000'000;
constexpr Timestamp kLensAgain_ns = 10 * kSecond_ns, kPointsAgain_ns = 2 * kSecond_ns;
constexpr char kCameraFrame[] = "camera", kWorldFrame[] = "world";

void AddFile(const google::protobuf::FileDescriptor& file, std::set<std::string>& there,
             google::protobuf::FileDescriptorSet& set) {
  if (!there.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) AddFile(*file.dependency(i), there, set);
  file.CopyTo(set.add_file());
}

/// A FileDescriptorSet with all that the message needs.
std::string SchemaOf(const google::protobuf::Descriptor& message) {
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> there;
  AddFile(*message.file(), there, set);
  return set.SerializeAsString();
}

void SetTime(Timestamp unix_ns, google::protobuf::Timestamp& out) {
  out.set_seconds(unix_ns / kSecond_ns);
  out.set_nanos(static_cast<std::int32_t>(unix_ns % kSecond_ns));
}

bool IsPlaced(const v1::PoseEvent& pose) {
  return pose.status() == v1::TRACKING_STATUS_TRACKING ||
         pose.status() == v1::TRACKING_STATUS_COASTING;
}

}  // namespace

/// Each has the one message type that first came to it.
class EventWriter::Channels {
 public:
  explicit Channels(McapWriter& mcap) : mcap_(mcap) {}

  /// Before any message: readers that stream know them all.
  template <typename Message>
  void Add(const char* topic) {
    const google::protobuf::Descriptor& type = *Message::descriptor();
    std::uint16_t& schema = schemas_[type.full_name()];
    if (schema == 0) schema = mcap_.AddSchema(type.full_name(), "protobuf", SchemaOf(type));
    ids_[topic] = mcap_.AddChannel(schema, topic, "protobuf");
  }
  template <typename Message>
  absl::Status Write(const char* topic, Timestamp unix_ns, const Message& message) {
    return mcap_.Write(ids_.at(topic), unix_ns, message.SerializeAsString());
  }

 private:
  McapWriter& mcap_;
  std::map<std::string, std::uint16_t> schemas_, ids_;
};

EventWriter::EventWriter(std::unique_ptr<McapWriter> mcap, const RecordedFrom& from)
    : mcap_(std::move(mcap)),
      unix_minus_monotonic_ns_(from.unix_minus_monotonic_ns),
      channels_(std::make_unique<Channels>(*mcap_)) {
  mcap_->AddMetadata("saccade",
                     {{"version", from.version},
                      {"source", from.source},
                      {"unix_minus_monotonic_ns", absl::StrCat(from.unix_minus_monotonic_ns)}});
  channels_->Add<foxglove::CompressedVideo>("/camera/video");
  channels_->Add<foxglove::CameraCalibration>("/camera/calibration");
  channels_->Add<foxglove::FrameTransform>("/tf");
  channels_->Add<foxglove::PointCloud>("/map/points");
  channels_->Add<v1::AccessUnit>("/saccade/picture");
  channels_->Add<v1::PoseEvent>("/saccade/pose");
  channels_->Add<v1::MapDelta>("/saccade/map");
  channels_->Add<v1::AnnotationEvent>("/saccade/annotations");
  channels_->Add<v1::GazeState>("/saccade/gaze");
  channels_->Add<v1::PresenceEvent>("/saccade/presence");
  channels_->Add<v1::StatisticsEvent>("/saccade/statistics");
  channels_->Add<v1::EndOfSource>("/saccade/end_of_source");
  channels_->Add<v1::PointerEvent>("/saccade/pointers");
  channels_->Add<v1::ChatEvent>("/saccade/chat");
  channels_->Add<v1::PicturePause>("/saccade/picture_pause");
  channels_->Add<v1::SceneEvent>("/saccade/scene");
  channels_->Add<v1::GetSurfaceResponse>("/saccade/surface");
}

EventWriter::~EventWriter() = default;

absl::StatusOr<std::unique_ptr<EventWriter>> EventWriter::Create(const std::filesystem::path& file,
                                                                 const RecordedFrom& from) {
  auto mcap = McapWriter::Create(file, absl::StrCat("saccade ", from.version));
  if (!mcap.ok()) return mcap.status();
  std::unique_ptr<EventWriter> writer(new EventWriter(*std::move(mcap), from));
  if (absl::Status flushed = writer->mcap().Flush(); !flushed.ok()) return flushed;
  return writer;
}

absl::Status EventWriter::WritePicture(const v1::AccessUnit& unit) {
  const Timestamp time_ns = unit.pose().capture_time_ns() + unix_minus_monotonic_ns_;
  foxglove::CompressedVideo video;
  SetTime(time_ns, *video.mutable_timestamp());
  video.set_frame_id(kCameraFrame);
  video.set_data(unit.data());
  video.set_format("h264");
  v1::AccessUnit facts = unit;
  facts.clear_data();  // it is in the other message
  absl::Status written = WriteLens(unit.intrinsics(), time_ns);
  written.Update(channels_->Write("/saccade/picture", time_ns, facts));
  written.Update(channels_->Write("/camera/video", time_ns, video));
  return written;
}

absl::Status EventWriter::WriteLens(const v1::CameraIntrinsics& lens, Timestamp time_ns) {
  std::string bytes = lens.SerializeAsString();
  if (bytes == lens_ && time_ns - lens_ns_ < kLensAgain_ns) return absl::OkStatus();
  lens_ = std::move(bytes);
  lens_ns_ = time_ns;
  foxglove::CameraCalibration out;
  switch (lens.model()) {
    case v1::CameraIntrinsics::MODEL_PINHOLE:
      out.set_distortion_model("plumb_bob");
      for (int i = 0; i < 5; ++i) out.add_d(0.0);
      break;
    case v1::CameraIntrinsics::MODEL_BROWN_CONRADY:
      out.set_distortion_model("plumb_bob");
      *out.mutable_d() = lens.distortion();
      break;
    case v1::CameraIntrinsics::MODEL_KANNALA_BRANDT:
      out.set_distortion_model("kannala_brandt");
      *out.mutable_d() = lens.distortion();
      break;
    default:
      return absl::OkStatus();  // nothing that viewers know: it is in /saccade/picture
  }
  SetTime(time_ns, *out.mutable_timestamp());
  out.set_frame_id(kCameraFrame);
  out.set_width(lens.width_px());
  out.set_height(lens.height_px());
  const std::array<double, 9> k = {
      lens.fx_px(), 0, lens.cx_px(), 0, lens.fy_px(), lens.cy_px(), 0, 0, 1};
  for (std::size_t i = 0; i < k.size(); ++i) {
    out.add_k(k[i]);
    out.add_r(i % 4 == 0 ? 1.0 : 0.0);
    out.add_p(k[i]);
    if (i % 3 == 2) out.add_p(0.0);
  }
  return channels_->Write("/camera/calibration", time_ns, out);
}

absl::Status EventWriter::WritePose(const v1::PoseEvent& pose) {
  const Timestamp time_ns = pose.capture_time_ns() + unix_minus_monotonic_ns_;
  absl::Status written = channels_->Write("/saccade/pose", time_ns, pose);
  if (!IsPlaced(pose)) return written;
  foxglove::FrameTransform transform;
  SetTime(time_ns, *transform.mutable_timestamp());
  transform.set_parent_frame_id(kWorldFrame);
  transform.set_child_frame_id(kCameraFrame);
  const v1::Vector3& t = pose.world_from_camera().translation_m();
  const v1::Quaternion& q = pose.world_from_camera().rotation();
  transform.mutable_translation()->set_x(t.x());
  transform.mutable_translation()->set_y(t.y());
  transform.mutable_translation()->set_z(t.z());
  transform.mutable_rotation()->set_x(q.x());
  transform.mutable_rotation()->set_y(q.y());
  transform.mutable_rotation()->set_z(q.z());
  transform.mutable_rotation()->set_w(q.w());
  written.Update(channels_->Write("/tf", time_ns, transform));
  return written;
}

absl::Status EventWriter::WriteMap(const v1::MapDelta& map, Timestamp time_ns) {
  absl::Status written = channels_->Write("/saccade/map", time_ns, map);
  if (map.full()) points_.clear();
  for (const v1::Feature& feature : map.upserted()) {
    points_[feature.id()] = feature.point_in_world_m();
  }
  for (const std::uint64_t id : map.removed_ids()) points_.erase(id);
  if (map.more() || (!map.full() && time_ns - points_ns_ < kPointsAgain_ns)) return written;
  points_ns_ = time_ns;
  foxglove::PointCloud cloud;
  SetTime(time_ns, *cloud.mutable_timestamp());
  cloud.set_frame_id(kWorldFrame);
  cloud.mutable_pose()->mutable_position();
  cloud.mutable_pose()->mutable_orientation()->set_w(1.0);
  cloud.set_point_stride(3 * sizeof(float));
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    foxglove::PackedElementField& field = *cloud.add_fields();
    field.set_name(name);
    field.set_offset(std::exchange(offset, offset + sizeof(float)));
    field.set_type(foxglove::PackedElementField::FLOAT32);
  }
  std::string& data = *cloud.mutable_data();
  for (const auto& [id, p] : points_) {
    const std::array<float, 3> xyz = {static_cast<float>(p.x()), static_cast<float>(p.y()),
                                      static_cast<float>(p.z())};
    data.append(reinterpret_cast<const char*>(xyz.data()), sizeof(xyz));
  }
  written.Update(channels_->Write("/map/points", time_ns, cloud));
  return written;
}

absl::Status EventWriter::Write(const v1::GetSurfaceResponse& surface, Timestamp now_ns) {
  return channels_->Write("/saccade/surface", now_ns + unix_minus_monotonic_ns_, surface);
}

absl::Status EventWriter::Write(const v1::Event& event, Timestamp came_ns) {
  const Timestamp time_ns = came_ns + unix_minus_monotonic_ns_;
  switch (event.event_case()) {
    case v1::Event::kPose:
      return WritePose(event.pose());
    case v1::Event::kMap:
      return WriteMap(event.map(), time_ns);
    case v1::Event::kAccessUnit:
      return WritePicture(event.access_unit());
    case v1::Event::kAnnotation:
      return channels_->Write("/saccade/annotations", time_ns, event.annotation());
    case v1::Event::kGaze:
      return channels_->Write("/saccade/gaze", time_ns, event.gaze());
    case v1::Event::kPresence:
      return channels_->Write("/saccade/presence", time_ns, event.presence());
    case v1::Event::kStatistics:
      return channels_->Write("/saccade/statistics", time_ns, event.statistics());
    case v1::Event::kEndOfSource:
      return channels_->Write("/saccade/end_of_source", time_ns, event.end_of_source());
    case v1::Event::kPointer:
      return channels_->Write("/saccade/pointers", time_ns, event.pointer());
    case v1::Event::kChat:
      return channels_->Write("/saccade/chat", time_ns, event.chat());
    case v1::Event::kPicturePause:
      return channels_->Write("/saccade/picture_pause", time_ns, event.picture_pause());
    case v1::Event::kScene:
      return channels_->Write("/saccade/scene", time_ns, event.scene());
    case v1::Event::kSurface:  // says only that there is something new: SurfaceRounds
    case v1::Event::kVoice:    // kept nowhere
    case v1::Event::EVENT_NOT_SET:
      break;
  }
  return absl::OkStatus();
}

}  // namespace saccade
