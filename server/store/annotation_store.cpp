#include "server/store/annotation_store.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "server/store/annotation_rows.hpp"
#include "server/store/sqlite.hpp"

namespace saccade {
namespace {

/// Holds DIR/annotations.lock for this process; the system lets go of it however the process ends.
class ProcessLock {
 public:
  static absl::StatusOr<ProcessLock> Take(const std::filesystem::path& file) {
    ProcessLock lock(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
    if (lock.descriptor_ < 0) {
      const std::string what = absl::StrCat(file.string(), ": ", std::strerror(errno));
      if (errno == ENOSPC || errno == EDQUOT) {
        return absl::ResourceExhaustedError(
            absl::StrCat(what, "; the disk is full: make room and try again"));
      }
      return absl::PermissionDeniedError(
          absl::StrCat(what, "; make the directory writable or choose another --data-dir"));
    }
    if (::flock(lock.descriptor_, LOCK_EX | LOCK_NB) != 0) {
      return absl::FailedPreconditionError(absl::StrCat(
          file.parent_path().string(),
          " is in use by another saccade-server; end that one or choose another --data-dir"));
    }
    return lock;
  }
  ProcessLock(ProcessLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  ProcessLock& operator=(ProcessLock&&) = delete;
  ~ProcessLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

 private:
  explicit ProcessLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

struct Item {
  std::optional<AnnotationChange> change;  // nothing: a barrier
  AnnotationStore::Done done;
};

absl::Status Configure(SqliteDatabase& database, const std::filesystem::path& file,
                       const AnnotationStore::Options& options) {
  for (const char* pragma :
       {"PRAGMA busy_timeout = 2000", "PRAGMA journal_mode = WAL", "PRAGMA synchronous = FULL",
        "PRAGMA wal_autocheckpoint = 256", "PRAGMA journal_size_limit = 4194304"}) {
    if (absl::Status status = database.Execute(pragma); !status.ok()) return status;
  }
  if (options.max_bytes > 0) {
    const std::string pragma = absl::StrCat("PRAGMA max_page_count = ",
                                            std::max<std::int64_t>(1, options.max_bytes / 4096));
    if (absl::Status status = database.Execute(pragma.c_str()); !status.ok()) return status;
  }
  const absl::StatusOr<std::string> check = database.Query("PRAGMA quick_check(1)");
  if (!check.ok()) return check.status();
  if (*check != "ok") {
    return absl::DataLossError(
        absl::StrCat(file.string(), " is damaged: ", *check,
                     "; move the file away, or salvage it with: sqlite3 FILE .recover"));
  }
  return absl::OkStatus();
}

}  // namespace

class AnnotationStore::Impl {
 public:
  Impl(ProcessLock lock, std::unique_ptr<SqliteDatabase> database, std::filesystem::path file,
       const Options& options)
      : lock_(std::move(lock)),
        database_(std::move(database)),
        file_(std::move(file)),
        options_(options),
        thread_([this](const std::stop_token& stop) { Run(stop); }) {}

  absl::Status Enqueue(Item item) {
    {
      const std::lock_guard guard(mutex_);
      if (!failure_.ok()) return failure_;
      if (queue_.size() >= options_.max_queued) {
        return absl::ResourceExhaustedError(absl::StrCat(
            "the store has ", queue_.size(), " changes waiting for the disk; try again later"));
      }
      queue_.push_back(std::move(item));
    }
    wake_.notify_one();
    return absl::OkStatus();
  }

  absl::StatusOr<StoredAnnotations> LoadAll() { return ReadAll(*database_, file_.string()); }
  std::uint64_t committed() const { return committed_.load(); }
  absl::Status failure() const {
    const std::lock_guard guard(mutex_);
    return failure_;
  }
  void Resume() {
    const std::lock_guard guard(mutex_);
    failure_ = absl::OkStatus();
  }

 private:
  /// Takes all that is queued each time; ends when asked to and nothing is left.
  void Run(const std::stop_token& stop) {
    for (;;) {
      std::deque<Item> batch;
      {
        std::unique_lock guard(mutex_);
        wake_.wait(guard, stop, [this] { return !queue_.empty(); });
        if (queue_.empty()) return;
        batch.swap(queue_);
      }
      const absl::Status status = CommitBatch(batch);
      if (!status.ok()) Refuse(status, batch);
      for (const Item& item : batch) {
        if (item.done) item.done(status);
      }
    }
  }

  /// One transaction for the batch. On error nothing of it is on disk.
  absl::Status CommitBatch(const std::deque<Item>& batch) {
    std::uint64_t last = 0;
    for (const Item& item : batch) {
      if (item.change) last = std::max(last, item.change->sequence);
    }
    if (last == 0) return absl::OkStatus();  // barriers only
    absl::Status status = database_->Execute("BEGIN IMMEDIATE");
    for (auto item = batch.begin(); status.ok() && item != batch.end(); ++item) {
      if (item->change) status = WriteChange(*database_, *item->change);
    }
    if (status.ok()) status = database_->Execute("COMMIT");
    if (status.ok()) {
      committed_.store(last);
    } else if (database_->InTransaction()) {
      database_->Execute("ROLLBACK").IgnoreError();
    }
    return status;
  }

  /// What was queued behind a failed batch was made on top of it: it fails too.
  void Refuse(const absl::Status& status, std::deque<Item>& batch) {
    const std::lock_guard guard(mutex_);
    failure_ = status;
    for (Item& item : queue_) batch.push_back(std::move(item));
    queue_.clear();
  }

  ProcessLock lock_;
  std::unique_ptr<SqliteDatabase> database_;  // LoadAll before the first Submit, then the thread
  std::filesystem::path file_;
  Options options_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<Item> queue_;  // guarded by mutex_
  absl::Status failure_;    // guarded by mutex_
  std::atomic<std::uint64_t> committed_ = 0;
  std::jthread thread_;  // last: joined first
};

absl::StatusOr<std::unique_ptr<AnnotationStore>> AnnotationStore::Open(
    const std::filesystem::path& directory) {
  return Open(directory, Options());
}

absl::StatusOr<std::unique_ptr<AnnotationStore>> AnnotationStore::Open(
    const std::filesystem::path& directory, const Options& options) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) {
    return absl::PermissionDeniedError(absl::StrCat("cannot create ", directory.string(), ": ",
                                                    error.message(),
                                                    "; choose another --data-dir"));
  }
  absl::StatusOr<ProcessLock> lock = ProcessLock::Take(directory / "annotations.lock");
  if (!lock.ok()) return lock.status();
  const std::filesystem::path file = directory / "annotations.sqlite";
  absl::StatusOr<std::unique_ptr<SqliteDatabase>> database = SqliteDatabase::Open(file);
  if (!database.ok()) return database.status();
  if (absl::Status status = Configure(**database, file, options); !status.ok()) return status;
  if (absl::Status status = Migrate(**database, file.string()); !status.ok()) return status;
  return std::unique_ptr<AnnotationStore>(new AnnotationStore(
      std::make_unique<Impl>(*std::move(lock), *std::move(database), file, options)));
}

AnnotationStore::AnnotationStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AnnotationStore::~AnnotationStore() = default;

absl::StatusOr<StoredAnnotations> AnnotationStore::LoadAll() { return impl_->LoadAll(); }

absl::Status AnnotationStore::Submit(AnnotationChange change, Done done) {
  return impl_->Enqueue({std::move(change), std::move(done)});
}

absl::Status AnnotationStore::SubmitBarrier(Done done) {
  return impl_->Enqueue({std::nullopt, std::move(done)});
}

std::uint64_t AnnotationStore::committed_sequence() const { return impl_->committed(); }
absl::Status AnnotationStore::failure() const { return impl_->failure(); }
void AnnotationStore::Resume() { impl_->Resume(); }

absl::Status AnnotationStore::Flush() {
  std::mutex mutex;
  std::condition_variable wake;
  std::optional<absl::Status> result;
  const absl::Status queued = SubmitBarrier([&](const absl::Status& status) {
    const std::lock_guard guard(mutex);
    result = status;
    wake.notify_one();
  });
  if (!queued.ok()) return queued;
  std::unique_lock guard(mutex);
  wake.wait(guard, [&] { return result.has_value(); });
  return *result;
}

}  // namespace saccade
