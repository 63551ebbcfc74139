#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <sys/types.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "server/store/sqlite.hpp"

namespace saccade {

/// Holds a file for this process (flock); the system lets go of it however the process ends.
class ProcessLock {
 public:
  /// FailedPrecondition: another process holds it. PermissionDenied, ResourceExhausted: it cannot
  /// be made.
  static absl::StatusOr<ProcessLock> Take(const std::filesystem::path& file);
  ProcessLock(ProcessLock&& other) noexcept;
  ProcessLock& operator=(ProcessLock&& other) noexcept;
  ~ProcessLock();

 private:
  explicit ProcessLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

/// DIR/annotations.sqlite with what belongs to it, for one process, readable by its owner alone.
///
/// While it is open, somebody may delete or replace the files; SQLite would go on writing to what
/// nobody will ever open again. EnsureInPlace() notices, and makes them whole again from the open
/// connection, which still has everything. One thread.
class StoreDatabase {
 public:
  /// As AnnotationStore::Open. A new data base appears under its name only when it is complete, so
  /// one of zero bytes was never made here and is refused.
  static absl::StatusOr<std::unique_ptr<StoreDatabase>> Open(const std::filesystem::path& directory,
                                                             std::int64_t max_bytes);

  /// OK: what is committed now will be found at the next start. Says on stderr what it had to
  /// write again.
  ///   FailedPrecondition  another file lies in the data base's place, or another process has the
  ///                       directory
  ///   as Open             it could not be written again
  absl::Status EnsureInPlace();

  /// Not before EnsureInPlace() was OK.
  SqliteDatabase& connection() { return *connection_; }
  const std::filesystem::path& file() const { return file_; }

 private:
  // Which file a name stands for; nothing: none.
  struct Identity {
    dev_t device = 0;
    ino_t number = 0;
    bool operator==(const Identity&) const = default;
  };
  static std::optional<Identity> IdentityOf(const std::filesystem::path& file);

  StoreDatabase(ProcessLock lock, std::filesystem::path directory, std::int64_t max_bytes);
  std::filesystem::path Beside(const char* suffix) const { return file_.string() + suffix; }
  absl::Status Connect();
  absl::Status WriteAgain();
  absl::Status JoinLog();
  absl::StatusOr<std::filesystem::path> CopyBeside();
  bool CompanionsInPlace() const;

  ProcessLock lock_;
  const std::filesystem::path directory_, file_;
  const std::int64_t max_bytes_;
  std::unique_ptr<SqliteDatabase> connection_;  // null after a failure, until EnsureInPlace
  std::optional<Identity> identity_;
  std::array<std::optional<Identity>, 2> companions_;  // -wal, -shm
};

}  // namespace saccade
