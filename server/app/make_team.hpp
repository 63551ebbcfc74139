#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>

#include "server/app/engine.hpp"
#include "server/app/server_config.hpp"
#include "server/app/team_runner.hpp"
#include "server/rpc/team_link.hpp"

namespace saccade {

/// This server's part in a team, by an id that is kept in `config.data_dir`: every server may be
/// joined, and is idle until then. Hears of frames from `engine`, which must be stopped first.
std::unique_ptr<TeamRunner> MakeTeam(const ServerConfig& config, Engine& engine);

/// Where --team leads; nothing without it. The error names the file that cannot be read.
absl::StatusOr<std::optional<TeamLinkOptions>> LinkOf(const ServerConfig& config);

}  // namespace saccade
