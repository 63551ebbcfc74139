// The part of the ledger that is of people who sign in: a row each, and a pass for each sign-in.
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/identity/access_ledger.hpp"

namespace saccade {
namespace {

constexpr int kMostPasses = 32;            // of one person at a time
constexpr std::size_t kIdCharacters = 12;  // of the key, behind the letter

}  // namespace

/// What is known of the person, as this sign-in changes it. Under the lock.
absl::StatusOr<InviteRow> AccessLedger::RowOf(const SignedIn& person) {
  const std::string id = absl::StrCat("s", person.key.substr(0, kIdCharacters));
  InviteRow row;
  const auto found = invites_.find(id);
  if (found != invites_.end()) {
    if (!SameSecret(found->second.secret_sha256, person.key)) {
      return absl::InternalError("access: two people have one id; ask for an invite");
    }
    row = found->second;
    if (row.facts.revoked) {
      return absl::UnauthenticatedError(
          "access: you were revoked here, and may not sign in again; ask who started the server");
    }
  } else if (!MakeRoom()) {
    return absl::ResourceExhaustedError(
        absl::StrCat("access: ", invites_.size(), " invites and people, as many as may be"));
  }
  int passes = 0;
  for (const auto& [pass_id, pass] : passes_) {
    if (pass.invite_id != id) continue;
    if (SameSecret(pass.proof_sha256, person.proof)) {
      return absl::UnauthenticatedError("access: this sign-in was used already; sign in again");
    }
    if (EndOf(pass, row.facts).ok()) ++passes;
  }
  if (passes >= kMostPasses) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "access: you signed in ", passes, " times, as often as may be at one time; wait"));
  }
  row.secret_sha256 = person.key;
  InviteFacts& facts = row.facts;
  if (facts.id.empty()) facts.created_unix_s = Now();
  facts.id = id;
  facts.person = true;
  facts.role = person.role;
  facts.label = person.name;
  facts.expires_unix_s = std::max(facts.expires_unix_s, person.expires_unix_s);
  facts.uses = ++facts.used;  // never open to Redeem
  facts.waits = options_.waiting_room && person.role < AccessRole::kWearer;
  return row;
}

absl::StatusOr<Issued> AccessLedger::SignIn(const SignedIn& person) {
  absl::StatusOr<InviteRow> row = absl::InternalError("");
  {
    const std::lock_guard guard(mutex_);
    row = RowOf(person);
  }
  if (!row.ok()) return row.status();
  const Token token = NewToken('p');
  const PassState state = row->facts.waits ? PassState::kWaiting : PassState::kIn;
  const PassRow pass{token.id, row->facts.id, Sha256Hex(token.secret), person.name,
                     Now(),    state,         person.expires_unix_s,   person.proof};
  const absl::Status kept = rows_ ? rows_->Put(*row, pass) : absl::OkStatus();
  if (!kept.ok()) return kept;
  const std::lock_guard guard(mutex_);
  ForgetEndedPasses(row->facts.id);
  invites_[row->facts.id] = *row;
  passes_[token.id] = pass;
  Issued issued{row->facts, token.ToString(), row->facts.waits};
  issued.invite.expires_unix_s = person.expires_unix_s;
  return issued;
}

// Told before, and their tokens are too old to be taken again.
void AccessLedger::ForgetEndedPasses(const std::string& invite_id) {
  absl::erase_if(passes_, [&](const auto& entry) {
    const auto& [id, pass] = entry;
    const bool gone = pass.invite_id == invite_id && pass.expires_unix_s != 0 &&
                      pass.expires_unix_s <= Now() && told_.contains(id);
    if (gone) told_.erase(id);
    return gone;
  });
}

absl::StatusOr<int> AccessLedger::LetBack(const std::string& id) {
  InviteRow row;
  {
    const std::lock_guard guard(mutex_);
    const auto found = invites_.find(id);
    if (found == invites_.end()) {
      return absl::NotFoundError(absl::StrCat("id: there is nobody called ", id.substr(0, 40),
                                              "; `saccade invites` lists them"));
    }
    if (!found->second.facts.person) {
      return absl::InvalidArgumentError("id: an invite ends for good; make another one");
    }
    row = found->second;
  }
  row.facts.revoked = false;
  // Those that were revoked stay ended, also over a restart: they expire now.
  row.facts.expires_unix_s = std::min(row.facts.expires_unix_s, Now());
  if (absl::Status kept = rows_ ? rows_->EndPasses(row) : absl::OkStatus(); !kept.ok()) return kept;
  const std::lock_guard guard(mutex_);
  int ended = 0;
  for (auto& [pass_id, pass] : passes_) {
    if (pass.invite_id != id) continue;
    told_[pass_id] = true;
    ++ended;
  }
  invites_[id] = row;
  return ended;
}

/// Of people whose sign-in is over and who are not barred, what is known can be forgotten: the next
/// one says it again. Under the lock; false: full.
bool AccessLedger::MakeRoom() {
  if (invites_.size() < options_.max_invites) return true;
  absl::flat_hash_map<std::string, bool> gone, used;
  for (const auto& [id, pass] : passes_) {
    if (!told_.contains(id)) used[pass.invite_id] = true;  // somebody may be watching by it
  }
  absl::erase_if(invites_, [&](const auto& entry) {
    const InviteFacts& facts = entry.second.facts;
    const bool over =
        facts.person && !facts.revoked && Now() >= facts.expires_unix_s && !used.contains(facts.id);
    if (over) gone[facts.id] = true;
    return over;
  });
  absl::erase_if(passes_, [&](const auto& entry) {
    const bool over = gone.contains(entry.second.invite_id);
    if (over) told_.erase(entry.first);
    return over;
  });
  return invites_.size() < options_.max_invites;
}

}  // namespace saccade
