#include "server/identity/access_book.hpp"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "server/identity/access_rows.hpp"
#include "server/identity/secret.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxWaiting = 256;
constexpr std::size_t kMaxUnwritten = 1000;    // entries of the audit
constexpr std::int64_t kKept_s = 30 * 86'400;  // an ended invite stays in the list so long
constexpr std::int64_t kLeastLife_s = 60, kMostLife_s = 31'536'000;
constexpr int kMostUses = 1000;
constexpr std::size_t kMaxLabelBytes = 60;

absl::Status Refused(absl::string_view what) {
  return absl::UnauthenticatedError(absl::StrCat("access: ", what, "; ask for a new one"));
}
absl::Status Unknown() { return Refused("this invite is not known here"); }

std::int64_t SystemUnix_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

absl::Status InviteDraft::Validate() const {
  if (role < AccessRole::kViewer || role > AccessRole::kWearer) {
    return absl::InvalidArgumentError("role: give viewer, annotator, pilot or wearer");
  }
  if (life_s < kLeastLife_s || life_s > kMostLife_s) {
    return absl::InvalidArgumentError(
        absl::StrCat("life_s: ", life_s, "; give ", kLeastLife_s, " to ", kMostLife_s));
  }
  if (uses < 1 || uses > kMostUses) {
    return absl::InvalidArgumentError(absl::StrCat("uses: ", uses, "; give 1 to ", kMostUses));
  }
  if (label.size() > kMaxLabelBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("label: ", label.size(), " bytes; at most ", kMaxLabelBytes));
  }
  return absl::OkStatus();
}

class AccessBook::Impl {
 public:
  Impl(std::unique_ptr<AccessRows> rows, Options options)
      : options_(std::move(options)),
        owner_(NewToken('o')),
        owner_text_(owner_.ToString()),
        owner_hash_(Sha256Hex(owner_.secret)),
        rows_(std::move(rows)) {
    if (!options_.now_unix_s) options_.now_unix_s = SystemUnix_s;
  }

  absl::Status Load() {
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
  void Start() {
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }

  const Options& options() const { return options_; }
  const std::string& owner_token() const { return owner_text_; }
  void SetOnEnded(OnEnded on_ended) {
    const std::lock_guard telling(telling_);  // nobody is being told once this returns
    on_ended_ = std::move(on_ended);
  }

  absl::StatusOr<Access> Check(absl::string_view text) const {
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

  void Post(std::function<void()> job, const std::function<void(absl::Status)>& refuse) {
    {
      const std::lock_guard guard(mutex_);
      if (jobs_.size() < kMaxWaiting) {
        jobs_.push_back(std::move(job));
        wake_.notify_one();
        return;
      }
    }
    refuse(absl::ResourceExhaustedError("access: too many requests wait for the disk"));
  }

  void Record(AuditFacts entry) {
    if (rows_ == nullptr) return;
    entry.unix_ms = std::chrono::duration_cast<std::chrono::milliseconds>(
                        std::chrono::system_clock::now().time_since_epoch())
                        .count();
    const std::lock_guard guard(mutex_);
    if (unwritten_.size() >= kMaxUnwritten) {
      ++lost_;
      return;
    }
    if (const auto pass = passes_.find(entry.access_id); pass != passes_.end()) {
      entry.invite_id = pass->second.invite_id;
    }
    unwritten_.push_back(std::move(entry));
  }

  // From here: the book's thread.

  absl::StatusOr<std::vector<AuditFacts>> ReadAudit(int most) {
    if (rows_ == nullptr) return std::vector<AuditFacts>();
    WriteAudit();
    return rows_->ReadAudit(most);
  }

  absl::StatusOr<Issued> CreateInvite(const InviteDraft& draft) {
    if (absl::Status valid = draft.Validate(); !valid.ok()) return valid;
    const Token token = NewToken('i');
    InviteRow row;
    row.facts = {token.id, draft.role, draft.label, Now(), Now() + draft.life_s, draft.uses};
    row.secret_sha256 = Sha256Hex(token.secret);
    {
      const std::lock_guard guard(mutex_);
      if (invites_.size() >= options_.max_invites) {
        return absl::ResourceExhaustedError(
            absl::StrCat("access: there are ", invites_.size(), " invites, as many as may be"));
      }
    }
    if (absl::Status kept = rows_ ? rows_->Put(row) : absl::OkStatus(); !kept.ok()) return kept;
    const std::lock_guard guard(mutex_);
    invites_[token.id] = row;
    return Issued{row.facts, token.ToString()};
  }

  absl::StatusOr<Issued> Redeem(const std::string& text) {
    const std::optional<Token> token = ParseToken(text);
    if (!token) return Unknown();
    InviteRow row;
    {
      const std::lock_guard guard(mutex_);
      const auto found = invites_.find(token->id);
      const bool same = found != invites_.end() &&
                        SameSecret(Sha256Hex(token->secret), found->second.secret_sha256);
      if (!same) return Unknown();
      row = found->second;
    }
    if (absl::Status ended = Ended(row.facts); !ended.ok()) return ended;
    if (row.facts.used >= row.facts.uses) return Refused("this invite has been used up");
    ++row.facts.used;
    const Token pass = NewToken('p');
    const PassRow pass_row{pass.id, row.facts.id, Sha256Hex(pass.secret)};
    const absl::Status kept = rows_ ? rows_->Put(row, pass_row) : absl::OkStatus();
    if (!kept.ok()) return kept;
    const std::lock_guard guard(mutex_);
    invites_[row.facts.id] = row;
    passes_[pass.id] = pass_row;
    return Issued{row.facts, pass.ToString()};
  }

  absl::StatusOr<int> Revoke(const std::string& invite_id) {
    InviteRow row;
    {
      const std::lock_guard guard(mutex_);
      const auto found = invites_.find(invite_id);
      if (found == invites_.end()) {
        return absl::NotFoundError(absl::StrCat("id: there is no invite ", invite_id.substr(0, 40),
                                                "; `saccade invites` lists them"));
      }
      row = found->second;
    }
    row.facts.revoked = true;
    {
      // In force before it is on the disk: whom one throws out is not to wait for it.
      const std::lock_guard guard(mutex_);
      invites_[invite_id].facts.revoked = true;
    }
    const int ended = TellEnded();
    if (absl::Status kept = rows_ ? rows_->Put(row) : absl::OkStatus(); !kept.ok()) return kept;
    return ended;
  }

  std::vector<InviteFacts> Invites() const {
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

 private:
  std::int64_t Now() const { return options_.now_unix_s(); }

  absl::Status Ended(const InviteFacts& invite) const {
    if (invite.revoked) return Refused("this invite was revoked");
    if (Now() >= invite.expires_unix_s) return Refused("this invite has expired");
    return absl::OkStatus();
  }

  absl::StatusOr<Access> CheckPass(const Token& token) const {
    const std::string hash = Sha256Hex(token.secret);
    const std::lock_guard guard(mutex_);
    const auto pass = passes_.find(token.id);
    if (pass == passes_.end() || !SameSecret(hash, pass->second.secret_sha256)) return Unknown();
    const auto invite = invites_.find(pass->second.invite_id);
    if (invite == invites_.end()) return Unknown();
    const InviteFacts& facts = invite->second.facts;
    if (absl::Status ended = Ended(facts); !ended.ok()) return ended;
    // Ended is ended, also where the clock was set back since.
    if (told_.contains(token.id)) return Refused("this invite has expired");
    return Access{token.id, facts.role, facts.expires_unix_s};
  }

  void Run(const std::stop_token& stop) {
    for (;;) {
      std::deque<std::function<void()>> jobs;
      {
        std::unique_lock guard(mutex_);
        // Invites expire by the wall clock, which may be set: looked at every half second.
        wake_.wait_for(guard, stop, std::chrono::milliseconds(500),
                       [this] { return !jobs_.empty(); });
        jobs.swap(jobs_);
      }
      for (const std::function<void()>& job : jobs) job();
      TellEnded();
      WriteAudit();
      if (jobs.empty() && stop.stop_requested()) return;
    }
  }

  void WriteAudit() {
    std::vector<AuditFacts> entries;
    std::size_t lost = 0;
    {
      const std::lock_guard guard(mutex_);
      entries.swap(unwritten_);
      lost = std::exchange(lost_, 0);
    }
    if (entries.empty()) return;
    if (lost > 0) {
      entries.push_back(entries.back());
      entries.back().call = absl::StrCat("and ", lost, " more that came too fast to be kept");
    }
    const absl::Status kept = rows_->Put(entries);
    if (!kept.ok()) Log(absl::StrCat("audit: ", entries.size(), " entries lost: ", kept.message()));
  }

  /// Tells of passes whose invite has ended, each once, by why. Returns their number.
  int TellEnded() {
    std::vector<std::pair<std::vector<std::string>, absl::Status>> told;
    {
      const std::lock_guard guard(mutex_);
      absl::flat_hash_map<std::string, std::vector<std::string>> by_invite;
      for (const auto& [id, pass] : passes_) {
        if (!told_.contains(id)) by_invite[pass.invite_id].push_back(id);
      }
      for (auto& [invite_id, ids] : by_invite) {
        const absl::Status why = Ended(invites_[invite_id].facts);
        if (why.ok()) continue;
        for (const std::string& id : ids) told_[id] = true;
        told.emplace_back(std::move(ids), why);
      }
    }
    int count = 0;
    const std::lock_guard telling(telling_);
    for (const auto& [ids, why] : told) {
      count += static_cast<int>(ids.size());
      if (on_ended_) on_ended_(ids, why);
    }
    return count;
  }

  Options options_;
  const Token owner_;
  const std::string owner_text_, owner_hash_;
  const std::unique_ptr<AccessRows> rows_;  // null: nothing is kept
  std::mutex telling_;
  OnEnded on_ended_;  // guarded by telling_
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::function<void()>> jobs_;  // guarded by mutex_, as what follows
  absl::flat_hash_map<std::string, InviteRow> invites_;
  absl::flat_hash_map<std::string, PassRow> passes_;
  absl::flat_hash_map<std::string, bool> told_;
  std::vector<AuditFacts> unwritten_;
  std::size_t lost_ = 0;
  std::jthread thread_;  // last: uses everything above
};

absl::StatusOr<std::unique_ptr<AccessBook>> AccessBook::Open(const std::filesystem::path& directory,
                                                             Options options) {
  absl::StatusOr<std::unique_ptr<AccessRows>> rows = AccessRows::Open(directory);
  if (!rows.ok()) return rows.status();
  auto impl = std::make_unique<Impl>(*std::move(rows), std::move(options));
  if (absl::Status loaded = impl->Load(); !loaded.ok()) return loaded;
  impl->Start();
  return std::unique_ptr<AccessBook>(new AccessBook(std::move(impl)));
}

std::unique_ptr<AccessBook> AccessBook::InMemory(Options options) {
  auto impl = std::make_unique<Impl>(nullptr, std::move(options));
  impl->Start();
  return std::unique_ptr<AccessBook>(new AccessBook(std::move(impl)));
}

AccessBook::AccessBook(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AccessBook::~AccessBook() = default;

bool AccessBook::token_required() const { return impl_->options().token_required; }
const std::string& AccessBook::owner_token() const { return impl_->owner_token(); }
void AccessBook::SetOnEnded(OnEnded on_ended) { impl_->SetOnEnded(std::move(on_ended)); }

absl::StatusOr<Access> AccessBook::Check(absl::string_view token) const {
  return impl_->Check(token);
}
void AccessBook::CreateInvite(InviteDraft draft, Done<Issued> done) {
  impl_->Post([this, draft = std::move(draft), done] { done(impl_->CreateInvite(draft)); }, done);
}
void AccessBook::Redeem(std::string token, Done<Issued> done) {
  impl_->Post([this, token = std::move(token), done] { done(impl_->Redeem(token)); }, done);
}
void AccessBook::Revoke(std::string invite_id, Done<int> done) {
  impl_->Post([this, id = std::move(invite_id), done] { done(impl_->Revoke(id)); }, done);
}
std::vector<InviteFacts> AccessBook::Invites() const { return impl_->Invites(); }
void AccessBook::Record(AuditFacts entry) { impl_->Record(std::move(entry)); }
void AccessBook::ReadAudit(int most, Done<std::vector<AuditFacts>> done) {
  impl_->Post([this, most, done] { done(impl_->ReadAudit(most)); }, done);
}

}  // namespace saccade
