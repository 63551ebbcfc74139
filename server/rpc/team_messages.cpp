#include "server/rpc/team_messages.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/team.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

constexpr int kMaxMarks = 500;
// Of a Tell (LargestRequest): what is beyond is not told.
constexpr std::size_t kMaxMarkBytes = 200 * 1024;

v1::TeamPose ToProto(const TeamPose& pose) {
  v1::TeamPose message;
  *message.mutable_pose() = wire::ToProtoPose(pose.pose, pose.pose.capture_time_ns);
  message.set_map_generation(pose.pose.map_generation);
  *message.mutable_camera() = wire::ToProto(pose.camera);
  return message;
}

absl::StatusOr<TeamPose> FromProto(const v1::TeamPose& message, absl::string_view field) {
  absl::StatusOr<MapSnapshot> pose = wire::FromProto(message.pose(), absl::StrCat(field, ".pose"));
  if (!pose.ok()) return pose.status();
  absl::StatusOr<CameraIntrinsics> camera =
      wire::FromProto(message.camera(), absl::StrCat(field, ".camera"));
  if (!camera.ok()) return camera.status();
  pose->map_generation = message.map_generation();
  return TeamPose{*std::move(pose), *camera};
}

}  // namespace

v1::TeamNews ToProto(const TeamNews& news) {
  v1::TeamNews message;
  message.set_device_id(news.device_id);
  message.set_display_name(news.display_name);
  message.set_sent_time_ns(news.sent_time_ns);
  for (const TeamKeyframe& keyframe : news.keyframes) {
    if (message.keyframes_size() == wire::kMaxTeamKeyframes) break;
    *message.add_keyframes() = wire::ToProto(keyframe);
  }
  if (news.pose) *message.mutable_pose() = ToProto(*news.pose);
  if (news.marks) {
    message.mutable_marks();
    std::size_t bytes = 0;
    for (const Annotation& mark : *news.marks) {
      v1::Annotation one = wire::ToProto(mark);
      bytes += one.ByteSizeLong();
      if (message.marks().annotations_size() == kMaxMarks || bytes > kMaxMarkBytes) break;
      *message.mutable_marks()->add_annotations() = std::move(one);
    }
  }
  return message;
}

absl::StatusOr<TeamNews> FromProto(const v1::TeamNews& message, absl::string_view field) {
  TeamNews news;
  absl::Status status = wire::CheckUuid(message.device_id(), absl::StrCat(field, ".device_id"));
  status.Update(wire::CheckText(message.display_name(), wire::kMaxNameBytes,
                                absl::StrCat(field, ".display_name")));
  if (message.keyframes_size() > wire::kMaxTeamKeyframes) {
    status.Update(absl::InvalidArgumentError(
        absl::StrCat(field, ".keyframes: at most ", wire::kMaxTeamKeyframes, " at a time")));
  }
  if (message.marks().annotations_size() > kMaxMarks) {
    status.Update(
        absl::InvalidArgumentError(absl::StrCat(field, ".marks.annotations: at most ", kMaxMarks)));
  }
  if (!status.ok()) return status;
  news.device_id = message.device_id();
  news.display_name = message.display_name();
  news.sent_time_ns = message.sent_time_ns();
  for (int k = 0; k < message.keyframes_size(); ++k) {
    absl::StatusOr<TeamKeyframe> keyframe =
        wire::FromProto(message.keyframes(k), absl::StrCat(field, ".keyframes[", k, "]"));
    if (!keyframe.ok()) return keyframe.status();
    news.keyframes.push_back(*std::move(keyframe));
  }
  if (message.has_pose()) {
    absl::StatusOr<TeamPose> pose = FromProto(message.pose(), absl::StrCat(field, ".pose"));
    if (!pose.ok()) return pose.status();
    news.pose = *std::move(pose);
  }
  if (!message.has_marks()) return news;
  news.marks.emplace();
  for (int k = 0; k < message.marks().annotations_size(); ++k) {
    absl::StatusOr<Annotation> mark = wire::FromProto(
        message.marks().annotations(k), absl::StrCat(field, ".marks.annotations[", k, "]"));
    if (!mark.ok()) return mark.status();
    news.marks->push_back(*std::move(mark));
  }
  return news;
}

v1::GetTeamResponse ToProto(const TeamState& state) {
  v1::GetTeamResponse message;
  message.set_device_id(state.device_id);
  message.set_display_name(state.display_name);
  message.set_keyframes(static_cast<std::uint32_t>(state.keyframes));
  for (const TeamMember& member : state.members) {
    v1::TeamMember& one = *message.add_members();
    one.set_device_id(member.device_id);
    one.set_display_name(member.display_name);
    one.set_heard(member.heard);
    one.set_merged(member.merged);
    one.set_keyframes(static_cast<std::uint32_t>(member.keyframes));
    if (member.pose) *one.mutable_pose() = ToProto(*member.pose);
    if (!member.merged) continue;
    const Similarity3& lies = member.own_from_member;
    one.set_scale(lies.scale);
    *one.mutable_own_from_member() = wire::ToProto(Rigid3{lies.rotation, lies.translation});
    one.set_sigma_m(member.sigma_m);
    one.set_sigma_rad(member.sigma_rad);
    one.set_revision(member.revision);
    one.set_places(static_cast<std::uint32_t>(member.places));
  }
  return message;
}

std::vector<std::shared_ptr<const TeamNews>> InParts(const std::shared_ptr<const TeamNews>& news) {
  constexpr std::size_t kMost = wire::kMaxTeamKeyframes;
  if (news->keyframes.empty() || (news->keyframes.size() <= kMost && !news->marks)) return {news};
  std::vector<std::shared_ptr<const TeamNews>> parts;
  auto first = std::make_shared<TeamNews>();
  first->device_id = news->device_id;
  first->display_name = news->display_name;
  first->sent_time_ns = news->sent_time_ns;
  const TeamNews bare = *first;
  first->pose = news->pose;
  first->marks = news->marks;
  parts.push_back(std::move(first));
  for (std::size_t k = 0; k < news->keyframes.size(); k += kMost) {
    auto part = std::make_shared<TeamNews>(bare);
    const auto begin = news->keyframes.begin() + static_cast<std::ptrdiff_t>(k);
    part->keyframes.assign(
        begin, begin + static_cast<std::ptrdiff_t>(std::min(kMost, news->keyframes.size() - k)));
    parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace saccade
