#include "server/store/annotation_store.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "server/store/annotation_rows.hpp"
#include "server/store/store_database.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

// How often the files are looked after while nothing is written.
constexpr std::chrono::seconds kLookAfter(1);

struct Item {
  std::vector<AnnotationChange> changes;  // none: a barrier
  AnnotationStore::Done done;
};

}  // namespace

class AnnotationStore::Impl {
 public:
  Impl(std::unique_ptr<StoreDatabase> database, const Options& options)
      : database_(std::move(database)),
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

  absl::StatusOr<StoredAnnotations> LoadAll() {
    const std::lock_guard guard(database_mutex_);
    if (absl::Status there = database_->EnsureInPlace(); !there.ok()) return there;
    return ReadAll(database_->connection(), database_->file().string());
  }
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
        wake_.wait_for(guard, stop, kLookAfter, [this] { return !queue_.empty(); });
        batch.swap(queue_);
      }
      if (batch.empty()) {
        LookAfterFiles();
        if (stop.stop_requested()) return;
        continue;
      }
      const absl::Status status = CommitBatch(batch);
      if (!status.ok()) Refuse(status, batch);
      for (const Item& item : batch) {
        if (item.done) item.done(status);
      }
    }
  }

  /// What was committed is found again, also if somebody deleted the files since. Says each new
  /// problem once.
  void LookAfterFiles() {
    const std::lock_guard guard(database_mutex_);
    const absl::Status there = database_->EnsureInPlace();
    if (!there.ok() && there.message() != told_) Log(absl::StrCat("store: ", there.message()));
    told_ = std::string(there.message());
  }

  /// One transaction for the batch. On error nothing of it is on disk.
  absl::Status CommitBatch(const std::deque<Item>& batch) {
    std::uint64_t last = 0;
    for (const Item& item : batch) {
      for (const AnnotationChange& change : item.changes) last = std::max(last, change.sequence);
    }
    if (last == 0) return absl::OkStatus();  // barriers only
    {
      const std::lock_guard guard(database_mutex_);
      if (absl::Status there = database_->EnsureInPlace(); !there.ok()) return there;
      if (absl::Status written = WriteBatch(batch); !written.ok()) return written;
    }
    committed_.store(last);
    LookAfterFiles();  // deleted just then: written again before anybody is answered
    return absl::OkStatus();
  }

  absl::Status WriteBatch(const std::deque<Item>& batch) {
    SqliteDatabase& database = database_->connection();
    absl::Status status = database.Execute("BEGIN IMMEDIATE");
    for (auto item = batch.begin(); status.ok() && item != batch.end(); ++item) {
      for (const AnnotationChange& change : item->changes) {
        if (status.ok()) status = WriteChange(database, change);
      }
    }
    if (status.ok()) status = database.Execute("COMMIT");
    if (!status.ok() && database.InTransaction()) database.Execute("ROLLBACK").IgnoreError();
    return status;
  }

  /// What was queued behind a failed batch was made on top of it: it fails too.
  void Refuse(const absl::Status& status, std::deque<Item>& batch) {
    const std::lock_guard guard(mutex_);
    failure_ = status;
    for (Item& item : queue_) batch.push_back(std::move(item));
    queue_.clear();
  }

  std::mutex database_mutex_;
  std::unique_ptr<StoreDatabase> database_;  // guarded by database_mutex_
  std::string told_;                         // likewise
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
  absl::StatusOr<std::unique_ptr<StoreDatabase>> database =
      StoreDatabase::Open(directory, options.max_bytes);
  if (!database.ok()) return database.status();
  return std::unique_ptr<AnnotationStore>(
      new AnnotationStore(std::make_unique<Impl>(*std::move(database), options)));
}

AnnotationStore::AnnotationStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AnnotationStore::~AnnotationStore() = default;

absl::StatusOr<StoredAnnotations> AnnotationStore::LoadAll() { return impl_->LoadAll(); }

absl::Status AnnotationStore::SubmitAll(std::vector<AnnotationChange> changes, Done done) {
  return impl_->Enqueue({std::move(changes), std::move(done)});
}

absl::Status AnnotationStore::SubmitBarrier(Done done) {
  return impl_->Enqueue({{}, std::move(done)});
}

std::uint64_t AnnotationStore::committed_sequence() const { return impl_->committed(); }
absl::Status AnnotationStore::failure() const { return impl_->failure(); }
void AnnotationStore::Resume() { impl_->Resume(); }

absl::Status AnnotationStore::Flush(std::chrono::milliseconds limit) {
  struct Shared {  // outlives a caller who does not wait to the end
    std::mutex mutex;
    std::condition_variable wake;
    std::optional<absl::Status> result;
  };
  const auto shared = std::make_shared<Shared>();
  const absl::Status queued = SubmitBarrier([shared](const absl::Status& status) {
    const std::lock_guard guard(shared->mutex);
    shared->result = status;
    shared->wake.notify_one();
  });
  if (!queued.ok()) return queued;
  std::unique_lock guard(shared->mutex);
  if (!shared->wake.wait_for(guard, limit, [&] { return shared->result.has_value(); })) {
    return absl::DeadlineExceededError("the disk does not answer");
  }
  return *shared->result;
}

}  // namespace saccade
