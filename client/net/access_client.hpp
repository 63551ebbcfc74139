#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/net/connection.hpp"

namespace saccade::net {

/// What lets somebody in. Roles are "viewer", "annotator", "pilot", "wearer".
struct Invite {
  std::string id, role, label;
  std::int64_t created_unix_s = 0, expires_unix_s = 0;
  std::uint32_t uses = 1, used = 0;
  bool revoked = false;
  bool waiting_room = false;
  bool person = false;  // no link, but somebody who signs in with their firm; `label` is their name
};
struct NewInvite {
  Invite invite;
  std::string link;  // told once
};
/// What an invite was redeemed for.
struct Pass {
  std::string token, role;
  std::int64_t expires_unix_s = 0;
  bool waiting = false;  // to be let in
};

/// Somebody who waits to be let in.
struct Waiting {
  std::string id, display_name, role, invite_id, label;
  std::int64_t since_unix_s = 0;
};

/// What somebody did. Ids as in presence and in the list of invites; empty: not known.
struct AuditEntry {
  std::int64_t unix_ms = 0;
  std::string participant_id, display_name, invite_id, call, outcome;
};

/// Invites of one server. Calls block, errors as of Connection.
class AccessClient {
 public:
  explicit AccessClient(const ConnectionOptions& options);
  ~AccessClient();

  /// `invite`: a link, or what stands behind its #invite=.
  absl::StatusOr<Pass> Redeem(const std::string& invite, const std::string& display_name = "");
  /// True while the holder of the token waits to be let in.
  absl::StatusOr<bool> Waits();
  /// The same with an ID token of the firm's provider, which the server takes once.
  absl::StatusOr<Pass> RedeemIdToken(const std::string& id_token);
  // With the owner's token. `life_s` and `uses` 0: as the server has them.
  absl::StatusOr<NewInvite> Create(const std::string& role, std::uint32_t life_s,
                                   std::uint32_t uses, const std::string& label,
                                   bool waiting_room = false);
  absl::StatusOr<std::vector<Invite>> List();
  absl::StatusOr<std::vector<Waiting>> WaitingRoom();
  /// Lets somebody in, or ends their pass.
  absl::StatusOr<Waiting> Admit(const std::string& id, bool refuse);
  /// How many passes ended with it. `undo`: of a person, who may sign in again.
  absl::StatusOr<int> Revoke(const std::string& id, bool undo = false);
  /// The newest `most` (1 to 10000; 0: 1000), oldest first.
  absl::StatusOr<std::vector<AuditEntry>> Audit(std::uint32_t most);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade::net
