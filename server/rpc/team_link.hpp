#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/pipeline/team_port.hpp"

namespace saccade {

struct TeamLinkOptions {
  std::string address;   // HOST:PORT of the other server
  std::string root_pem;  // of its authority; empty: plain
  std::string token;     // where it needs one; empty: none, or by `invite`
  std::string invite;    // "ID.SECRET", redeemed once where there is no token; empty: none
  std::string name;      // who asks to be let in
  /// Keeps the token that the invite gave, for the next start.
  std::function<void(const std::string& token)> keep_token = [](const std::string& /*token*/) {};
};

/// The way to another server (--team): follows it, and tells it what the own port tells. Where it
/// is not there, or gone, the link tries again every second; what was told meanwhile
/// is told then. Threads of its own; nobody waits for it.
class TeamLink {
 public:
  /// `team` outlives the link.
  TeamLink(TeamLinkOptions options, TeamPort& team);
  /// Within a second, whatever the other does.
  ~TeamLink();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
