#include "server/store/store_database.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "server/store/annotation_rows.hpp"
#include "server/store/store_files.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCompanions[] = {"-wal", "-shm"};

absl::Status Configure(SqliteDatabase& database, const fs::path& file, std::int64_t max_bytes) {
  for (const char* pragma :
       {"PRAGMA busy_timeout = 2000", "PRAGMA journal_mode = WAL", "PRAGMA synchronous = FULL",
        "PRAGMA wal_autocheckpoint = 256", "PRAGMA journal_size_limit = 4194304"}) {
    if (absl::Status status = database.Execute(pragma); !status.ok()) return status;
  }
  if (max_bytes > 0) {
    const std::string pragma =
        absl::StrCat("PRAGMA max_page_count = ", std::max<std::int64_t>(1, max_bytes / 4096));
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

/// Complete under another name first: whoever is killed meanwhile leaves no half of a data base.
absl::Status CreateNew(const fs::path& file) {
  const fs::path scratch = file.string() + ".new";
  std::error_code ignored;
  for (const char* suffix : {"-wal", "-shm", "-journal"}) {
    fs::remove(scratch.string() + suffix, ignored);
  }
  if (absl::Status created = CreatePrivate(scratch); !created.ok()) return created;
  absl::StatusOr<std::unique_ptr<SqliteDatabase>> database = SqliteDatabase::Open(scratch);
  if (!database.ok()) return database.status();
  absl::Status status = Configure(**database, scratch, 0);
  if (status.ok()) status = Migrate(**database, file.string());
  database->reset();  // and with it its log
  if (status.ok()) status = PublishFile(scratch, file);
  if (!status.ok()) fs::remove(scratch, ignored);
  return status;
}

}  // namespace

absl::StatusOr<ProcessLock> ProcessLock::Take(const fs::path& file) {
  ProcessLock lock(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (lock.descriptor_ < 0) return StoreFileError(file, errno);
  if (::flock(lock.descriptor_, LOCK_EX | LOCK_NB) != 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        file.parent_path().string(),
        " is in use by another saccade-server; end that one or choose another --data-dir"));
  }
  return lock;
}
ProcessLock::ProcessLock(ProcessLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}
ProcessLock& ProcessLock::operator=(ProcessLock&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}
ProcessLock::~ProcessLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::optional<StoreDatabase::Identity> StoreDatabase::IdentityOf(const fs::path& file) {
  struct stat what {};
  if (::stat(file.c_str(), &what) != 0) return std::nullopt;
  return Identity{what.st_dev, what.st_ino};
}

StoreDatabase::StoreDatabase(ProcessLock lock, fs::path directory, std::int64_t max_bytes)
    : lock_(std::move(lock)),
      directory_(std::move(directory)),
      file_(directory_ / "annotations.sqlite"),
      max_bytes_(max_bytes) {}

absl::StatusOr<std::unique_ptr<StoreDatabase>> StoreDatabase::Open(const fs::path& directory,
                                                                   std::int64_t max_bytes) {
  if (absl::Status ready = PrepareDirectory(directory); !ready.ok()) return ready;
  absl::StatusOr<ProcessLock> lock = ProcessLock::Take(directory / "annotations.lock");
  if (!lock.ok()) return lock.status();
  std::unique_ptr<StoreDatabase> store(new StoreDatabase(*std::move(lock), directory, max_bytes));
  if (absl::Status fit = CheckDatabaseFile(store->file_); !fit.ok()) return fit;
  MakePrivate(directory);
  std::error_code ignored;
  fs::remove(store->Beside(".part"), ignored);
  if (!IdentityOf(store->file_)) {
    PutAsideStrayLog(store->file_);
    // The last run may have been killed between copying and renaming (WriteAgain).
    const fs::path restored = store->Beside(".restored");
    absl::Status made =
        IdentityOf(restored) ? PublishFile(restored, store->file_) : CreateNew(store->file_);
    if (!made.ok()) return made;
  }
  if (absl::Status connected = store->Connect(); !connected.ok()) return connected;
  return store;
}

absl::Status StoreDatabase::Connect() {
  absl::StatusOr<std::unique_ptr<SqliteDatabase>> database = SqliteDatabase::Open(file_);
  if (!database.ok()) return database.status();
  if (absl::Status status = Configure(**database, file_, max_bytes_); !status.ok()) return status;
  if (absl::Status status = Migrate(**database, file_.string()); !status.ok()) return status;
  connection_ = *std::move(database);
  identity_ = IdentityOf(file_);
  for (std::size_t i = 0; i < companions_.size(); ++i) {
    companions_[i] = IdentityOf(Beside(kCompanions[i]));
  }
  return absl::OkStatus();
}

bool StoreDatabase::CompanionsInPlace() const {
  for (std::size_t i = 0; i < companions_.size(); ++i) {
    if (companions_[i] && companions_[i] != IdentityOf(Beside(kCompanions[i]))) return false;
  }
  return true;
}

absl::Status StoreDatabase::EnsureInPlace() {
  const std::optional<Identity> now = IdentityOf(file_);
  if (!now) return WriteAgain();
  if (now != identity_) {
    return absl::FailedPreconditionError(absl::StrCat(
        file_.string(),
        " was replaced by another file while this server ran, which keeps what it had and saves "
        "nothing more: move that file away and it is written again, or restart the server to "
        "take that file"));
  }
  if (connection_ && CompanionsInPlace()) return absl::OkStatus();
  return JoinLog();
}

/// The data base is in place, its log is not: all goes into the data base, and a new log begins.
absl::Status StoreDatabase::JoinLog() {
  if (connection_) {
    const absl::Status joined = connection_->Execute("PRAGMA wal_checkpoint(TRUNCATE)");
    if (!joined.ok()) return joined;
    connection_ = nullptr;  // first: two connections would share what was deleted
  }
  if (absl::Status connected = Connect(); !connected.ok()) return connected;
  Log(absl::StrCat(file_.string(),
                   ": its -wal or -shm file was deleted while this server ran; nothing is lost, "
                   "both are there again"));
  return absl::OkStatus();
}

/// All that the open connection has, complete and on the disk, as a file beside the data base.
absl::StatusOr<fs::path> StoreDatabase::CopyBeside() {
  const fs::path part = Beside(".part"), restored = Beside(".restored");
  if (absl::Status created = CreatePrivate(part); !created.ok()) return created;
  absl::Status copied = connection_->CopyInto(part);
  if (copied.ok()) copied = PublishFile(part, restored);
  std::error_code ignored;
  if (!copied.ok()) fs::remove(part, ignored);
  if (!copied.ok()) return copied;
  return restored;
}

/// The data base's name is gone. What it stood for is still open, and has everything.
absl::Status StoreDatabase::WriteAgain() {
  if (!connection_) {
    return absl::DataLossError(absl::StrCat(
        file_.string(), " was deleted while this server could not open it; restart the server"));
  }
  if (absl::Status ready = PrepareDirectory(directory_); !ready.ok()) return ready;
  const fs::path lock_file = directory_ / "annotations.lock";
  if (!IdentityOf(lock_file)) {  // deleted too: another process could take a new one
    absl::StatusOr<ProcessLock> lock = ProcessLock::Take(lock_file);
    if (!lock.ok()) return lock.status();
    lock_ = *std::move(lock);
  }
  const absl::StatusOr<fs::path> copy = CopyBeside();
  if (!copy.ok()) return copy.status();
  std::error_code ignored;
  for (const char* suffix : kCompanions) fs::remove(Beside(suffix), ignored);
  if (absl::Status published = PublishFile(*copy, file_); !published.ok()) return published;
  // Closed last, and without taking the new files' names away.
  connection_->KeepFilesOnClose();
  std::unique_ptr<SqliteDatabase> before = std::move(connection_);
  if (absl::Status connected = Connect(); !connected.ok()) {
    connection_ = std::move(before);
    fs::remove(file_, ignored);
    return connected;
  }
  Log(absl::StrCat(file_.string(),
                   ": was deleted while this server ran; all annotations are written again"));
  return absl::OkStatus();
}

}  // namespace saccade
