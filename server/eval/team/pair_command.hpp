#pragma once

#include "server/eval/team/team_command.hpp"

namespace saccade {

/// Two recordings side by side (RunPair): DIR/report.json and DIR/A, DIR/B as of `run`. Truth is
/// used where both have it; it must be of one world.
absl::Status PairCommand(const TeamArguments& arguments);
/// RunForeignRooms: DIR/report.json. FailedPrecondition: a pair was merged.
absl::Status ForeignCommand(const TeamArguments& arguments);

}  // namespace saccade
