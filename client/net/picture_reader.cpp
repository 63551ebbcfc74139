#include "client/net/picture_reader.hpp"

#include <absl/strings/str_cat.h>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/scene.hpp"

namespace saccade::net {
namespace {

using Ids = google::protobuf::RepeatedField<std::uint64_t>;
using Sixteenths = google::protobuf::RepeatedField<std::int32_t>;

absl::Status Take(FeatureState state, const Ids& ids, const Sixteenths& px16, const char* field,
                  SeenFeatures& seen) {
  if (px16.size() != 2 * ids.size()) {
    return absl::InvalidArgumentError(absl::StrCat("access_unit.features.", field, ": needs ",
                                                   2 * ids.size(), " numbers, not ", px16.size()));
  }
  for (int i = 0; i < ids.size(); ++i) {
    seen[ids[i]] = {state, Eigen::Vector2d(px16[2 * i], px16[2 * i + 1]) / 16.0};
  }
  return absl::OkStatus();
}

absl::StatusOr<SeenFeatures> FromProto(const v1::FrameFeatures& message) {
  SeenFeatures seen;
  absl::Status taken =
      Take(FeatureState::kFailed, message.failed_ids(), message.failed_px16(), "failed_px16", seen);
  if (taken.ok()) {
    taken = Take(FeatureState::kMeasured, message.measured_ids(), message.measured_px16(),
                 "measured_px16", seen);
  }
  if (!taken.ok()) return taken;
  return seen;
}

}  // namespace

absl::StatusOr<CodedPicture> PictureReader::Read(const v1::AccessUnit& unit, Timestamp arrived_ns) {
  if (unit.codec() != v1::VIDEO_CODEC_H264) {
    return absl::InvalidArgumentError(absl::StrCat("access_unit.codec: ", unit.codec(),
                                                   " is not known here; is this client older than "
                                                   "the server?"));
  }
  const std::string lens = unit.intrinsics().SerializeAsString();
  if (camera_ == nullptr || lens != lens_) {
    absl::StatusOr<CameraIntrinsics> intrinsics =
        wire::FromProto(unit.intrinsics(), "access_unit.intrinsics");
    if (!intrinsics.ok()) return intrinsics.status();
    camera_ = std::make_shared<const CameraModel>(*intrinsics);
    lens_ = lens;
  }
  auto facts = std::make_shared<FrameFacts>();
  facts->frame_id = unit.frame_id();
  facts->camera = camera_;
  facts->arrived_ns = arrived_ns;
  facts->stages = {.captured_ns = unit.stages().captured_ns(),
                   .received_ns = unit.stages().received_ns(),
                   .tracked_ns = unit.stages().tracked_ns(),
                   .encoded_ns = unit.stages().encoded_ns()};
  if (unit.has_pose()) {
    absl::StatusOr<MapSnapshot> pose = wire::FromProto(unit.pose(), "access_unit.pose");
    if (!pose.ok()) return pose.status();
    // Picture and pose are one: another frame's pose would draw marks where they are not.
    if (pose->frame_id != facts->frame_id) {
      return absl::InvalidArgumentError(absl::StrCat("access_unit.pose: of frame ", pose->frame_id,
                                                     ", the picture is ", facts->frame_id));
    }
    facts->pose = *std::move(pose);
    for (const v1::MarkerPose& message : unit.pose().markers()) {
      absl::StatusOr<MarkerPose> marker = wire::FromProto(message, "access_unit.pose.markers");
      if (!marker.ok()) return marker.status();
      facts->markers.push_back(*std::move(marker));
    }
  }
  if (unit.has_features()) {
    absl::StatusOr<SeenFeatures> seen = FromProto(unit.features());
    if (!seen.ok()) return seen.status();
    facts->features = *std::move(seen);
  }
  return CodedPicture{std::move(facts), unit.key_frame(), unit.data()};
}

}  // namespace saccade::net
