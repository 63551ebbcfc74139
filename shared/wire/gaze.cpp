#include "shared/wire/gaze.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>

#include "shared/wire/bad_field.hpp"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::wire {
namespace {

GazePilot PilotFromProto(const v1::GazePilot& message) {
  return {message.participant_id(), message.display_name()};
}

// The enum and its message count alike from NO_MOUNT = 1.
v1::GazeMode ModeToProto(GazeMode mode) {
  return static_cast<v1::GazeMode>(static_cast<int>(mode) + v1::GAZE_MODE_NO_MOUNT);
}
static_assert(static_cast<int>(GazeMode::kNoMount) == 0 &&
              static_cast<int>(GazeMode::kParked) ==
                  static_cast<int>(v1::GAZE_MODE_PARKED) - v1::GAZE_MODE_NO_MOUNT);

absl::Status NumbersFromProto(const v1::GazeState& message, absl::string_view field,
                              GazeSnapshot& state) {
  if (message.has_pan_rad() || message.has_elevation_rad() || message.has_cyclotorsion_rad()) {
    state.joints_rad = {message.pan_rad(), message.elevation_rad(), message.cyclotorsion_rad()};
    if (!state.joints_rad->allFinite()) {
      return BadField(absl::StrCat(field, ".pan_rad"), "joint angles must be finite numbers");
    }
  }
  if (message.has_error_rad()) state.error_rad = message.error_rad();
  if (message.has_guidance_rad()) state.guidance_rad = message.guidance_rad();
  state.miss_rad = message.miss_rad();
  if (!std::isfinite(state.error_rad.value_or(0)) ||
      !std::isfinite(state.guidance_rad.value_or(0)) || !std::isfinite(state.miss_rad)) {
    return BadField(absl::StrCat(field, ".error_rad"), "angles must be finite numbers");
  }
  return absl::OkStatus();
}

}  // namespace

v1::GazeTarget ToProto(const GazeTarget& target) {
  v1::GazeTarget message;
  if (const auto* annotation = std::get_if<GazeAnnotation>(&target)) {
    message.set_annotation_id(annotation->id);
  } else if (const auto* feature = std::get_if<GazeFeature>(&target)) {
    message.set_feature_id(feature->id);
  } else {
    *message.mutable_point_in_world_m() = ToProto(std::get<GazePoint>(target).in_world);
  }
  return message;
}

v1::GazePilot ToProto(const GazePilot& pilot) {
  v1::GazePilot message;
  message.set_participant_id(pilot.participant_id);
  message.set_display_name(pilot.display_name);
  return message;
}

v1::GazeState ToProto(const GazeSnapshot& state) {
  v1::GazeState message;
  message.set_mode(ModeToProto(state.mode));
  if (state.joints_rad) {
    message.set_pan_rad(state.joints_rad->x());
    message.set_elevation_rad(state.joints_rad->y());
    message.set_cyclotorsion_rad(state.joints_rad->z());
  }
  if (state.target) *message.mutable_target() = ToProto(*state.target);
  if (state.target_in_world) *message.mutable_target_in_world_m() = ToProto(*state.target_in_world);
  if (state.error_rad) message.set_error_rad(*state.error_rad);
  message.set_arrived(state.arrived);
  message.set_target_lost(state.target_lost);
  message.set_unreachable(!state.reachable);
  message.set_miss_rad(state.miss_rad);
  message.set_fast(state.fast);
  message.set_problem(state.problem);
  if (state.pilot) *message.mutable_pilot() = ToProto(*state.pilot);
  for (const GazePilot& waiting : state.queue) *message.add_queue() = ToProto(waiting);
  message.set_paused(state.paused);
  message.set_handovers(state.handovers);
  message.set_last_handover(state.last_handover);
  if (state.guidance_rad) message.set_guidance_rad(*state.guidance_rad);
  message.set_time_ns(state.time_ns);
  return message;
}

absl::StatusOr<GazeTarget> FromProto(const v1::GazeTarget& message, absl::string_view field) {
  switch (message.target_case()) {
    case v1::GazeTarget::kAnnotationId: {
      absl::Status uuid = CheckUuid(message.annotation_id(), absl::StrCat(field, ".annotation_id"));
      if (!uuid.ok()) return uuid;
      return GazeAnnotation{message.annotation_id()};
    }
    case v1::GazeTarget::kFeatureId:
      return GazeFeature{message.feature_id()};
    case v1::GazeTarget::kPointInWorldM: {
      const absl::StatusOr<Eigen::Vector3d> point =
          FromProto(message.point_in_world_m(), absl::StrCat(field, ".point_in_world_m"));
      if (!point.ok()) return point.status();
      return GazePoint{*point};
    }
    case v1::GazeTarget::TARGET_NOT_SET:
      break;
  }
  return BadField(field, "is missing: give annotation_id, feature_id or point_in_world_m");
}

absl::StatusOr<GazeSnapshot> FromProto(const v1::GazeState& message, absl::string_view field) {
  GazeSnapshot state;
  if (!v1::GazeMode_IsValid(message.mode()) || message.mode() == v1::GAZE_MODE_UNSPECIFIED) {
    return BadField(absl::StrCat(field, ".mode"),
                    absl::StrCat("unknown mode ", static_cast<int>(message.mode())));
  }
  state.mode = static_cast<GazeMode>(message.mode() - v1::GAZE_MODE_NO_MOUNT);
  if (absl::Status numbers = NumbersFromProto(message, field, state); !numbers.ok()) return numbers;
  if (message.has_target()) {
    absl::StatusOr<GazeTarget> target = FromProto(message.target(), absl::StrCat(field, ".target"));
    if (!target.ok()) return target.status();
    state.target = *std::move(target);
  }
  if (message.has_target_in_world_m()) {
    const absl::StatusOr<Eigen::Vector3d> point =
        FromProto(message.target_in_world_m(), absl::StrCat(field, ".target_in_world_m"));
    if (!point.ok()) return point.status();
    state.target_in_world = *point;
  }
  state.arrived = message.arrived();
  state.target_lost = message.target_lost();
  state.reachable = !message.unreachable();
  state.fast = message.fast();
  state.problem = message.problem();
  if (message.has_pilot()) state.pilot = PilotFromProto(message.pilot());
  for (const v1::GazePilot& waiting : message.queue())
    state.queue.push_back(PilotFromProto(waiting));
  state.paused = message.paused();
  state.handovers = message.handovers();
  state.last_handover = message.last_handover();
  state.time_ns = message.time_ns();
  return state;
}

}  // namespace saccade::wire
