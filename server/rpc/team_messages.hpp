#pragma once

#include <absl/status/statusor.h>

#include "saccade/v1/team.pb.h"
#include "server/pipeline/team_port.hpp"

namespace saccade {

/// News on the wire. Keyframes beyond the fourth are left out: whoever has more sends several.
v1::TeamNews ToProto(const TeamNews& news);
/// Checked: errors name the field.
absl::StatusOr<TeamNews> FromProto(const v1::TeamNews& message, absl::string_view field);

v1::GetTeamResponse ToProto(const TeamState& state);

/// The same news in parts of at most four keyframes each, as many as it takes.
std::vector<std::shared_ptr<const TeamNews>> InParts(const std::shared_ptr<const TeamNews>& news);

}  // namespace saccade
