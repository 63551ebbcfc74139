#include "server/identity/access_book.hpp"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "server/identity/access_ledger.hpp"
#include "server/identity/access_rows.hpp"
#include "server/pipeline/rate_limiter.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxWaiting = 256;
constexpr std::size_t kMaxUnwritten = 1000;  // entries of the audit
constexpr RateLimit kKeptRefusals{0.1, 50};  // of one pass
constexpr std::int64_t kLeastLife_s = 60, kMostLife_s = 31'536'000;
constexpr int kMostUses = 1000;
constexpr std::size_t kMaxLabelBytes = 60;

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
      : rows_(std::move(rows)), ledger_(rows_.get(), std::move(options)) {}

  void Start() {
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }

  AccessLedger& ledger() { return ledger_; }
  void SetOnEnded(OnEnded on_ended) {
    const std::lock_guard telling(telling_);  // nobody is being told once this returns
    on_ended_ = std::move(on_ended);
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
    // Who tries the same forbidden thing over and over must not push others' deeds out.
    const bool refused = entry.outcome != "ok";
    const Timestamp now_ns = MonotonicNow();
    ledger_.Name(entry);
    const std::lock_guard guard(mutex_);
    if (unwritten_.size() >= kMaxUnwritten ||
        (refused && refusals_.Take(entry.access_id, now_ns))) {
      ++lost_;
      return;
    }
    unwritten_.push_back(std::move(entry));
  }

  // From here: the book's thread.

  absl::StatusOr<std::vector<AuditFacts>> ReadAudit(int most) {
    if (rows_ == nullptr) return std::vector<AuditFacts>();
    WriteAudit();
    return rows_->ReadAudit(most);
  }

  absl::StatusOr<int> Revoke(const std::string& invite_id) {
    const absl::StatusOr<InviteRow> revoked = ledger_.Revoke(invite_id);
    if (!revoked.ok()) return revoked.status();
    const int ended = TellEnded();
    if (absl::Status kept = ledger_.Keep(*revoked); !kept.ok()) return kept;
    return ended;
  }

 private:
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
      if (unwritten_.empty()) return;  // what was lost is told with the next
      entries.swap(unwritten_);
      lost = std::exchange(lost_, 0);
    }
    if (lost > 0) {
      const std::string call = absl::StrCat("and ", lost, " more that came too fast to be kept");
      entries.push_back({entries.back().unix_ms, "", "", "", "", call, ""});
    }
    const absl::Status kept = rows_->Put(entries);
    if (!kept.ok()) Log(absl::StrCat("audit: ", entries.size(), " entries lost: ", kept.message()));
  }

  /// Tells of passes whose invite has ended. Returns their number.
  int TellEnded() {
    int count = 0;
    const AccessLedger::Ended told = ledger_.TakeEnded();
    const std::lock_guard telling(telling_);
    for (const auto& [ids, why] : told) {
      count += static_cast<int>(ids.size());
      if (on_ended_) on_ended_(ids, why);
    }
    return count;
  }

  const std::unique_ptr<AccessRows> rows_;  // null: nothing is kept
  AccessLedger ledger_;
  std::mutex telling_;
  OnEnded on_ended_;  // guarded by telling_
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::function<void()>> jobs_;  // guarded by mutex_, as what follows
  std::vector<AuditFacts> unwritten_;
  RateLimiter refusals_{kKeptRefusals};
  std::size_t lost_ = 0;
  std::jthread thread_;  // last: uses everything above
};

absl::StatusOr<std::unique_ptr<AccessBook>> AccessBook::Open(const std::filesystem::path& directory,
                                                             Options options) {
  absl::StatusOr<std::unique_ptr<AccessRows>> rows = AccessRows::Open(directory);
  if (!rows.ok()) return rows.status();
  auto impl = std::make_unique<Impl>(*std::move(rows), std::move(options));
  if (absl::Status loaded = impl->ledger().Load(); !loaded.ok()) return loaded;
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

bool AccessBook::token_required() const { return impl_->ledger().options().token_required; }
const std::string& AccessBook::owner_token() const { return impl_->ledger().owner_token(); }
void AccessBook::SetOnEnded(OnEnded on_ended) { impl_->SetOnEnded(std::move(on_ended)); }

absl::StatusOr<Access> AccessBook::Check(absl::string_view token) const {
  return impl_->ledger().Check(token);
}
void AccessBook::CreateInvite(InviteDraft draft, Done<Issued> done) {
  impl_->Post([this, draft = std::move(draft), done] { done(impl_->ledger().CreateInvite(draft)); },
              done);
}
void AccessBook::Redeem(std::string token, Done<Issued> done, std::string display_name) {
  impl_->Post([this, token = std::move(token), name = std::move(display_name),
               done] { done(impl_->ledger().Redeem(token, name)); },
              done);
}
void AccessBook::Revoke(std::string invite_id, Done<int> done) {
  impl_->Post([this, id = std::move(invite_id), done] { done(impl_->Revoke(id)); }, done);
}
void AccessBook::SignIn(SignedIn person, Done<Issued> done) {
  impl_->Post([this, person = std::move(person), done] { done(impl_->ledger().SignIn(person)); },
              done);
}
void AccessBook::LetBack(std::string id, Done<int> done) {
  impl_->Post([this, id = std::move(id), done] { done(impl_->ledger().LetBack(id)); }, done);
}
std::vector<WaitingFacts> AccessBook::Waiting() const { return impl_->ledger().Waiting(); }
void AccessBook::Admit(std::string id, bool refuse, Done<WaitingFacts> done) {
  impl_->Post([this, id = std::move(id), refuse, done] { done(impl_->ledger().Admit(id, refuse)); },
              done);
}
std::vector<InviteFacts> AccessBook::Invites() const { return impl_->ledger().Invites(); }
void AccessBook::Record(AuditFacts entry) { impl_->Record(std::move(entry)); }
void AccessBook::ReadAudit(int most, Done<std::vector<AuditFacts>> done) {
  impl_->Post([this, most, done] { done(impl_->ReadAudit(most)); }, done);
}

}  // namespace saccade
