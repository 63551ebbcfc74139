#pragma once

#include <memory>

#include "server/app/engine.hpp"
#include "server/app/server_config.hpp"
#include "server/app/team_runner.hpp"
#include "server/rpc/team_link.hpp"

namespace saccade {

/// This server's part in a team, by an id that is kept in `config.data_dir`: every server may be
/// joined, and is idle until then. Hears of frames from `engine`, which must be stopped first.
std::unique_ptr<TeamRunner> MakeTeam(const ServerConfig& config, Engine& engine);

/// Null without --team.
std::unique_ptr<TeamLink> LinkOf(const ServerConfig& config, TeamPort& team);

}  // namespace saccade
