#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/identity/access_book.hpp"
#include "server/identity/access_rows.hpp"
#include "server/identity/secret.hpp"

namespace saccade {

/// The invites and passes of an AccessBook, in memory and in its rows. Checks come from any thread;
/// changes from the book's alone, as they wait for the disk.
class AccessLedger {
 public:
  /// `rows` null: nothing is kept. It outlives this.
  AccessLedger(AccessRows* rows, AccessBook::Options options);

  absl::Status Load();
  const AccessBook::Options& options() const { return options_; }
  const std::string& owner_token() const { return owner_text_; }

  // What AccessBook says of the same.
  absl::StatusOr<Access> Check(absl::string_view text) const;
  absl::StatusOr<Issued> CreateInvite(const InviteDraft& draft);
  absl::StatusOr<Issued> Redeem(const std::string& text, const std::string& display_name);
  absl::StatusOr<Issued> SignIn(const SignedIn& person);
  absl::StatusOr<int> LetBack(const std::string& id);
  std::vector<WaitingFacts> Waiting() const;
  absl::StatusOr<WaitingFacts> Admit(const std::string& id, bool refuse);
  /// In force when it returns, and then to be kept: whom one throws out is not to wait for the
  /// disk. NotFound: no such invite.
  absl::StatusOr<InviteRow> Revoke(const std::string& invite_id);
  absl::Status Keep(const InviteRow& invite);
  std::vector<InviteFacts> Invites() const;
  /// Fills in the invite of the entry's pass; of who signed in, also the name that is theirs.
  void Name(AuditFacts& entry) const;

  /// Passes that have ended, by why; each is told once.
  using Ended = std::vector<std::pair<std::vector<std::string>, absl::Status>>;
  Ended TakeEnded();

 private:
  std::int64_t Now() const { return options_.now_unix_s(); }
  absl::Status EndOf(const InviteFacts& invite) const;
  absl::Status EndOf(const PassRow& pass, const InviteFacts& invite) const;
  absl::StatusOr<InviteRow> RowOf(const SignedIn& person);
  bool MakeRoom();
  void ForgetEndedPasses(const std::string& invite_id);
  WaitingFacts FactsOf(const PassRow& pass, const InviteFacts& invite) const;
  absl::StatusOr<Access> CheckPass(const Token& token) const;

  AccessBook::Options options_;
  const Token owner_;
  const std::string owner_text_, owner_hash_;
  AccessRows* const rows_;
  mutable std::mutex mutex_;  // guards what follows
  absl::flat_hash_map<std::string, InviteRow> invites_;
  absl::flat_hash_map<std::string, PassRow> passes_;
  absl::flat_hash_map<std::string, bool> told_;
};

}  // namespace saccade
