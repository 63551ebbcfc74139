#include "shared/wire/team.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <cstring>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::wire {
namespace {

constexpr int kWordBytes = 8, kWords = 4;
constexpr int kBytes = TeamPoint::kScales * kWords * kWordBytes;  // of a point

absl::Status Bad(absl::string_view field, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", problem));
}

void Append(const TeamPoint& point, std::string& bytes) {
  for (const auto& descriptor : point.descriptors) {
    for (const std::uint64_t word : descriptor) {
      for (int k = 0; k < kWordBytes; ++k) bytes.push_back(static_cast<char>(word >> (8 * k)));
    }
  }
}

void Read(const char* bytes, TeamPoint& point) {
  for (auto& descriptor : point.descriptors) {
    for (std::uint64_t& word : descriptor) {
      word = 0;
      for (int k = 0; k < kWordBytes; ++k) {
        word |= std::uint64_t{static_cast<unsigned char>(*bytes++)} << (8 * k);
      }
    }
  }
}

absl::Status CheckLists(const v1::TeamKeyframe& message, absl::string_view field) {
  const int count = message.ranges_size();
  if (count > kMaxTeamPoints) {
    return Bad(absl::StrCat(field, ".ranges"), absl::StrCat("at most ", kMaxTeamPoints));
  }
  const auto expect = [&](const char* name, std::size_t size, std::size_t factor) -> absl::Status {
    if (size == factor * static_cast<std::size_t>(count)) return absl::OkStatus();
    return Bad(absl::StrCat(field, ".", name),
               absl::StrCat(size, " are not ", factor, " for each of ", count, " ranges"));
  };
  absl::Status status = expect("pixels_px", static_cast<std::size_t>(message.pixels_px_size()), 2);
  status.Update(expect("descriptors", message.descriptors().size(), kBytes));
  status.Update(expect("present", message.present().size(), 1));
  return status;
}

absl::Status ReadPoints(const v1::TeamKeyframe& message, absl::string_view field,
                        TeamKeyframe& keyframe) {
  const CameraIntrinsics& camera = keyframe.camera;
  for (int k = 0; k < message.ranges_size(); ++k) {
    TeamPoint point;
    point.pixel = {message.pixels_px(2 * k), message.pixels_px(2 * k + 1)};
    point.range = message.ranges(k);
    if (!std::isfinite(point.range) || point.range < 0 || point.range > kMaxCoordinateM) {
      return Bad(absl::StrCat(field, ".ranges[", k, "]"), "must be 0 or above, and finite");
    }
    if (!(point.pixel.x() >= -0.5 && point.pixel.y() >= -0.5 &&
          point.pixel.x() <= camera.width - 0.5 && point.pixel.y() <= camera.height - 0.5)) {
      return Bad(absl::StrCat(field, ".pixels_px[", 2 * k, "]"), "is outside the picture");
    }
    Read(message.descriptors().data() + static_cast<std::ptrdiff_t>(k) * kBytes, point);
    const auto present = static_cast<unsigned char>(message.present()[static_cast<std::size_t>(k)]);
    for (int s = 0; s < TeamPoint::kScales; ++s) point.present[s] = (present >> s & 1) != 0;
    keyframe.points.push_back(point);
  }
  return absl::OkStatus();
}

}  // namespace

v1::TeamKeyframe ToProto(const TeamKeyframe& keyframe) {
  v1::TeamKeyframe message;
  message.set_frame_id(keyframe.frame);
  message.set_edition(keyframe.edition);
  message.set_capture_time_ns(keyframe.capture_time_ns);
  message.set_told_time_ns(keyframe.told_time_ns);
  message.set_map_generation(keyframe.generation);
  message.set_metric(keyframe.metric);
  *message.mutable_camera() = ToProto(keyframe.camera);
  *message.mutable_world_from_camera() = ToProto(keyframe.world_from_camera);
  for (const TeamPoint& point : keyframe.points) {
    message.add_pixels_px(static_cast<float>(point.pixel.x()));
    message.add_pixels_px(static_cast<float>(point.pixel.y()));
    message.add_ranges(static_cast<float>(point.range));
    Append(point, *message.mutable_descriptors());
    char present = 0;
    for (int s = 0; s < TeamPoint::kScales; ++s) {
      present = static_cast<char>(present | (point.present[s] ? 1 << s : 0));
    }
    message.mutable_present()->push_back(present);
  }
  return message;
}

absl::StatusOr<TeamKeyframe> FromProto(const v1::TeamKeyframe& message, absl::string_view field) {
  TeamKeyframe keyframe;
  keyframe.frame = message.frame_id();
  keyframe.edition = message.edition();
  keyframe.capture_time_ns = message.capture_time_ns();
  keyframe.told_time_ns = message.told_time_ns();
  keyframe.generation = message.map_generation();
  keyframe.metric = message.metric();
  absl::StatusOr<CameraIntrinsics> camera =
      FromProto(message.camera(), absl::StrCat(field, ".camera"));
  if (!camera.ok()) return camera.status();
  keyframe.camera = *camera;
  absl::StatusOr<Rigid3> pose =
      FromProto(message.world_from_camera(), absl::StrCat(field, ".world_from_camera"));
  if (!pose.ok()) return pose.status();
  keyframe.world_from_camera = *pose;
  absl::Status lists = CheckLists(message, field);
  if (!lists.ok()) return lists;
  lists = ReadPoints(message, field, keyframe);
  if (!lists.ok()) return lists;
  return keyframe;
}

}  // namespace saccade::wire
