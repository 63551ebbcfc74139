#include "server/store/store_files.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/time/clock.h>
#include <absl/time/time.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "shared/io/log.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kOthers = 077;

/// A data base is in it, nothing else is, and it is this user's: not /tmp, nor what others share.
bool HoldsOnlyTheStore(const fs::path& directory) {
  std::error_code error;
  struct stat what {};
  if (::stat(directory.c_str(), &what) != 0 || what.st_uid != ::geteuid() ||
      (what.st_mode & S_ISVTX) != 0 || !fs::exists(directory / "annotations.sqlite", error)) {
    return false;
  }
  for (fs::directory_iterator it(directory, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    const bool ours = absl::StartsWith(name, "annotations.") || absl::StartsWith(name, "access.") ||
                      name == "tls" || name == "owner.json" || name == "maps" ||
                      name == "recordings";
    if (!ours) return false;
  }
  return !error;
}

void MakePrivate(const fs::path& path, mode_t mode) {
  struct stat what {};
  if (::stat(path.c_str(), &what) != 0 || (what.st_mode & kOthers) == 0) return;
  const std::string before = absl::StrFormat("%03o", what.st_mode & 0777u);
  if (::chmod(path.c_str(), mode) == 0) {
    Log(absl::StrCat(path.string(), ": was open to others (", before,
                     "); now only its owner reads it"));
  } else {
    Log(absl::StrCat(path.string(), ": is open to others (", before,
                     ") and cannot be changed: ", std::strerror(errno)));
  }
}

absl::Status Sync(const fs::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return StoreFileError(path, errno);
  const int failed = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  return failed == 0 ? absl::OkStatus() : StoreFileError(path, failed);
}

}  // namespace

absl::Status StoreFileError(const fs::path& file, int error) {
  const std::string what = absl::StrCat(file.string(), ": ", std::strerror(error));
  if (error == ENOSPC || error == EDQUOT) {
    return absl::ResourceExhaustedError(
        absl::StrCat(what, "; the disk is full: make room and try again"));
  }
  return absl::PermissionDeniedError(
      absl::StrCat(what, "; make the directory writable or choose another --data-dir"));
}

absl::Status PrepareDirectory(const fs::path& given) {
  std::error_code error;
  const fs::path directory = fs::absolute(given / "", error).parent_path();  // no slash at its end
  fs::create_directories(directory.parent_path(), error);
  if (!error && ::mkdir(directory.c_str(), 0700) != 0) {
    const int failed = errno;
    std::error_code ignored;
    if (failed == EEXIST && fs::is_directory(directory, ignored)) return absl::OkStatus();
    error = std::error_code(failed, std::generic_category());
  }
  if (!error) return absl::OkStatus();
  if (error.value() == ENOSPC) return StoreFileError(directory, error.value());
  return absl::PermissionDeniedError(absl::StrCat("cannot create ", given.string(), ": ",
                                                  error.message(), "; choose another --data-dir"));
}

void MakePrivate(const fs::path& directory) {
  for (const char* name : {"annotations.sqlite", "annotations.sqlite-wal", "annotations.sqlite-shm",
                           "annotations.lock"}) {
    MakePrivate(directory / name, 0600);
  }
  if (HoldsOnlyTheStore(directory)) MakePrivate(directory, 0700);
}

absl::Status CheckDatabaseFile(const fs::path& file) {
  struct stat what {};
  if (::stat(file.c_str(), &what) != 0) {
    return errno == ENOENT ? absl::OkStatus() : StoreFileError(file, errno);
  }
  if (!S_ISREG(what.st_mode)) {
    return absl::PermissionDeniedError(absl::StrCat(
        file.string(), ": is no regular file; move it away or choose another --data-dir"));
  }
  if (what.st_size > 0) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(
      file.string(),
      ": is empty (0 bytes), which a data base never is: something emptied it; put a copy in its "
      "place, or remove it to begin without annotations"));
}

absl::Status CreatePrivate(const fs::path& file) {
  if (::unlink(file.c_str()) != 0 && errno != ENOENT) return StoreFileError(file, errno);
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0) return StoreFileError(file, errno);
  ::close(descriptor);
  return absl::OkStatus();
}

absl::Status PublishFile(const fs::path& from, const fs::path& to) {
  if (absl::Status synced = Sync(from, 0); !synced.ok()) return synced;
  if (::rename(from.c_str(), to.c_str()) != 0) return StoreFileError(to, errno);
  return Sync(to.parent_path().empty() ? fs::path(".") : to.parent_path(), O_DIRECTORY);
}

void PutAsideStrayLog(const fs::path& file) {
  const fs::path log = file.string() + "-wal";
  std::error_code ignored;
  fs::remove(file.string() + "-shm", ignored);
  if (!fs::exists(log, ignored)) return;
  if (fs::file_size(log, ignored) == 0) {
    fs::remove(log, ignored);
    return;
  }
  const fs::path aside = absl::StrCat(
      log.string(), absl::FormatTime(".%Y%m%dT%H%M%SZ", absl::Now(), absl::UTCTimeZone()));
  fs::rename(log, aside, ignored);
  Log(absl::StrCat(file.string(), ": is missing, but its log was there; the log is kept as ",
                   aside.string(), ": put both back together to have what they hold"));
}

}  // namespace saccade
