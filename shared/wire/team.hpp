#pragma once

#include <absl/status/statusor.h>

#include "saccade/v1/team.pb.h"
#include "shared/scene/team_keyframe.hpp"

/// Keyframes of a team on the wire; everything is checked as in from_proto.hpp.
namespace saccade::wire {

inline constexpr int kMaxTeamPoints = 1000;
inline constexpr int kMaxTeamKeyframes = 4;

v1::TeamKeyframe ToProto(const TeamKeyframe& keyframe);
/// Pixels and ranges as float: 0.03 px at worst in a picture of 4096.
absl::StatusOr<TeamKeyframe> FromProto(const v1::TeamKeyframe& message, absl::string_view field);

}  // namespace saccade::wire
