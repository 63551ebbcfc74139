#include "server/identity/access_ledger.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <optional>

namespace saccade {
namespace {

constexpr std::int64_t kKept_s = 30 * 86'400;  // an ended invite stays in the list so long

absl::Status Refused(absl::string_view what) {
  return absl::UnauthenticatedError(absl::StrCat("access: ", what, "; ask for a new one"));
}
absl::Status Unknown() { return Refused("this invite is not known here"); }
absl::Status SignedOut() {
  return absl::UnauthenticatedError("access: your sign-in has expired; sign in again");
}
absl::Status Barred() {
  return absl::UnauthenticatedError(
      "access: your sign-in was revoked; ask who started the server (saccade revoke --undo)");
}

std::int64_t SystemUnix_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

AccessLedger::AccessLedger(AccessRows* rows, AccessBook::Options options)
    : options_(std::move(options)),
      owner_(NewToken('o')),
      owner_text_(owner_.ToString()),
      owner_hash_(Sha256Hex(owner_.secret)),
      rows_(rows) {
  if (!options_.now_unix_s) options_.now_unix_s = SystemUnix_s;
}

absl::Status AccessLedger::Load() {
  std::vector<InviteRow> invites;
  std::vector<PassRow> passes;
  const absl::Status loaded = rows_->Load(Now() - kKept_s, invites, passes);
  for (InviteRow& invite : invites) {
    std::string id = invite.facts.id;
    invites_[std::move(id)] = std::move(invite);
  }
  for (PassRow& pass : passes) {
    if (!invites_.contains(pass.invite_id)) continue;
    std::string id = pass.id;
    passes_[std::move(id)] = std::move(pass);
  }
  return loaded;
}

absl::StatusOr<Access> AccessLedger::Check(absl::string_view text) const {
  if (text.empty()) {
    if (!options_.token_required) return Access();
    return absl::UnauthenticatedError(
        "access: this server lets in who has an invite; ask for a link and open it");
  }
  const std::optional<Token> token = ParseToken(text);
  if (token && SameSecret(Sha256Hex(token->secret), owner_hash_) && token->id == owner_.id) {
    return Access{owner_.id, AccessRole::kOwner, 0};
  }
  absl::StatusOr<Access> pass = token ? CheckPass(*token) : Unknown();
  // Where nobody needs a token, one of another server or an older run keeps nobody out.
  if (!pass.ok() && !options_.token_required) return Access();
  return pass;
}

absl::StatusOr<Issued> AccessLedger::CreateInvite(const InviteDraft& draft) {
  if (absl::Status valid = draft.Validate(); !valid.ok()) return valid;
  const Token token = NewToken('i');
  InviteRow row;
  row.facts = {token.id, draft.role, draft.label, Now(), Now() + draft.life_s, draft.uses};
  row.facts.waits = draft.waits || (options_.waiting_room && draft.role < AccessRole::kWearer);
  row.secret_sha256 = Sha256Hex(token.secret);
  {
    const std::lock_guard guard(mutex_);
    if (!MakeRoom()) {
      return absl::ResourceExhaustedError(
          absl::StrCat("access: there are ", invites_.size(), " invites, as many as may be"));
    }
  }
  if (absl::Status kept = rows_ ? rows_->Put(row) : absl::OkStatus(); !kept.ok()) return kept;
  const std::lock_guard guard(mutex_);
  invites_[token.id] = row;
  return Issued{row.facts, token.ToString()};
}

absl::StatusOr<Issued> AccessLedger::Redeem(const std::string& text,
                                            const std::string& display_name) {
  const std::optional<Token> token = ParseToken(text);
  if (!token || token->id.front() != 'i') return Unknown();
  InviteRow row;
  {
    const std::lock_guard guard(mutex_);
    const auto found = invites_.find(token->id);
    const bool same = found != invites_.end() &&
                      SameSecret(Sha256Hex(token->secret), found->second.secret_sha256);
    if (!same) return Unknown();
    row = found->second;
  }
  if (absl::Status ended = EndOf(row.facts); !ended.ok()) return ended;
  if (row.facts.used >= row.facts.uses) return Refused("this invite has been used up");
  ++row.facts.used;
  const Token pass = NewToken('p');
  // Also by an invite that is older than the waiting room.
  row.facts.waits |= options_.waiting_room && row.facts.role < AccessRole::kWearer;
  const bool waits = row.facts.waits;
  const PassRow pass_row{pass.id,
                         row.facts.id,
                         Sha256Hex(pass.secret),
                         display_name.empty() ? "guest" : display_name,
                         Now(),
                         waits ? PassState::kWaiting : PassState::kIn};
  const absl::Status kept = rows_ ? rows_->Put(row, pass_row) : absl::OkStatus();
  if (!kept.ok()) return kept;
  const std::lock_guard guard(mutex_);
  invites_[row.facts.id] = row;
  passes_[pass.id] = pass_row;
  return Issued{row.facts, pass.ToString(), waits};
}

WaitingFacts AccessLedger::FactsOf(const PassRow& pass, const InviteFacts& invite) const {
  return {pass.id, pass.display_name, invite.role, pass.since_unix_s, invite.id, invite.label};
}

std::vector<WaitingFacts> AccessLedger::Waiting() const {
  std::vector<WaitingFacts> all;
  {
    const std::lock_guard guard(mutex_);
    for (const auto& [id, pass] : passes_) {
      if (pass.state != PassState::kWaiting) continue;
      const auto invite = invites_.find(pass.invite_id);
      if (invite == invites_.end() || !EndOf(pass, invite->second.facts).ok()) continue;
      all.push_back(FactsOf(pass, invite->second.facts));
    }
  }
  std::sort(all.begin(), all.end(), [](const WaitingFacts& a, const WaitingFacts& b) {
    return std::pair(a.since_unix_s, a.id) < std::pair(b.since_unix_s, b.id);
  });
  return all;
}

absl::StatusOr<WaitingFacts> AccessLedger::Admit(const std::string& id, bool refuse) {
  PassRow row;
  WaitingFacts facts;
  {
    const std::lock_guard guard(mutex_);
    const auto found = passes_.find(id);
    const auto invite =
        found == passes_.end() ? invites_.end() : invites_.find(found->second.invite_id);
    if (invite == invites_.end() || found->second.state != PassState::kWaiting ||
        !EndOf(found->second, invite->second.facts).ok()) {
      return absl::NotFoundError(
          absl::StrCat("id: nobody called ", id.substr(0, 40), " waits (any more)"));
    }
    row = found->second;
    facts = FactsOf(row, invite->second.facts);
  }
  row.state = refuse ? PassState::kRefused : PassState::kIn;
  if (absl::Status kept = rows_ ? rows_->Put(row) : absl::OkStatus(); !kept.ok()) return kept;
  const std::lock_guard guard(mutex_);
  passes_[id] = row;
  return facts;
}

absl::StatusOr<InviteRow> AccessLedger::Revoke(const std::string& invite_id) {
  const std::lock_guard guard(mutex_);
  const auto found = invites_.find(invite_id);
  if (found == invites_.end()) {
    return absl::NotFoundError(absl::StrCat("id: there is no invite ", invite_id.substr(0, 40),
                                            "; `saccade invites` lists them"));
  }
  found->second.facts.revoked = true;
  return found->second;
}

absl::Status AccessLedger::Keep(const InviteRow& invite) {
  return rows_ ? rows_->Put(invite) : absl::OkStatus();
}

std::vector<InviteFacts> AccessLedger::Invites() const {
  std::vector<InviteFacts> all;
  {
    const std::lock_guard guard(mutex_);
    for (const auto& [id, invite] : invites_) all.push_back(invite.facts);
  }
  std::sort(all.begin(), all.end(), [](const InviteFacts& a, const InviteFacts& b) {
    return std::pair(a.created_unix_s, a.id) > std::pair(b.created_unix_s, b.id);
  });
  return all;
}

void AccessLedger::Name(AuditFacts& entry) const {
  const std::lock_guard guard(mutex_);
  const auto pass = passes_.find(entry.access_id);
  if (pass == passes_.end()) return;
  entry.invite_id = pass->second.invite_id;
  const auto invite = invites_.find(entry.invite_id);
  if (invite != invites_.end() && invite->second.facts.person) {
    entry.display_name = invite->second.facts.label;
  }
}

AccessLedger::Ended AccessLedger::TakeEnded() {
  const std::lock_guard guard(mutex_);
  absl::flat_hash_map<std::string, std::pair<std::vector<std::string>, absl::Status>> by_why;
  for (const auto& [id, pass] : passes_) {
    if (told_.contains(id)) continue;
    const absl::Status why = EndOf(pass, invites_[pass.invite_id].facts);
    if (why.ok()) continue;
    told_[id] = true;
    auto& [ids, reason] = by_why[std::string(why.message())];
    ids.push_back(id);
    reason = why;
  }
  Ended told;
  for (auto& [words, group] : by_why) told.push_back(std::move(group));
  return told;
}

absl::Status AccessLedger::EndOf(const InviteFacts& invite) const {
  if (invite.person && invite.revoked) return Barred();
  if (invite.revoked) return Refused("this invite was revoked");
  if (Now() < invite.expires_unix_s) return absl::OkStatus();
  return invite.person ? SignedOut() : Refused("this invite has expired");
}

absl::Status AccessLedger::EndOf(const PassRow& pass, const InviteFacts& invite) const {
  if (absl::Status ended = EndOf(invite); !ended.ok()) return ended;
  return pass.expires_unix_s != 0 && Now() >= pass.expires_unix_s ? SignedOut() : absl::OkStatus();
}

absl::StatusOr<Access> AccessLedger::CheckPass(const Token& token) const {
  const std::string hash = Sha256Hex(token.secret);
  const std::lock_guard guard(mutex_);
  const auto pass = passes_.find(token.id);
  if (pass == passes_.end() || !SameSecret(hash, pass->second.secret_sha256)) return Unknown();
  const auto invite = invites_.find(pass->second.invite_id);
  if (invite == invites_.end()) return Unknown();
  const InviteFacts& facts = invite->second.facts;
  if (absl::Status ended = EndOf(pass->second, facts); !ended.ok()) return ended;
  // Ended is ended, also where the clock was set back, or the person was let back, since.
  if (told_.contains(token.id)) {
    return facts.person ? SignedOut() : Refused("this invite has expired");
  }
  if (pass->second.state == PassState::kRefused) return Refused("you were not let in");
  const bool waiting = pass->second.state == PassState::kWaiting;
  const std::int64_t own_end = pass->second.expires_unix_s;
  // Whoever compares roles alone lets nobody in too early.
  return Access{token.id,
                waiting ? AccessRole::kAnyone : facts.role,
                own_end != 0 ? own_end : facts.expires_unix_s,
                waiting,
                facts.id,
                facts.person ? facts.label : ""};
}

}  // namespace saccade
