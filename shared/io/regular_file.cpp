#include "shared/io/regular_file.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <optional>

namespace saccade {
namespace {

const char* KindOf(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a named pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

absl::Status SystemError(const std::filesystem::path& file, int error) {
  const std::string what = absl::StrCat(file.string(), ": ", std::strerror(error));
  switch (error) {
    case ENOENT:
    case ENOTDIR:
    case ENAMETOOLONG:
    case ELOOP:
      return absl::NotFoundError(absl::StrCat(what, "; create the file or correct the path"));
    case EACCES:
    case EPERM:
      return absl::PermissionDeniedError(
          absl::StrCat(what, ": cannot be read; check its permissions"));
    case EMFILE:
    case ENFILE:
      return absl::ResourceExhaustedError(
          absl::StrCat(what, "; close other files or connections, or raise the limit (ulimit -n)"));
    default:
      return absl::DataLossError(absl::StrCat(what, "; reading failed"));
  }
}

/// What speaks against reading it, by what stat says.
absl::Status Check(const std::filesystem::path& file, const struct stat& what,
                   std::size_t max_bytes, absl::string_view kind) {
  if (!S_ISREG(what.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": is ", KindOf(what.st_mode),
                                                   ", not ", kind, "; give a regular file"));
  }
  if (what.st_size > 0 && static_cast<std::size_t>(what.st_size) > max_bytes) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", what.st_size,
                                                   " bytes is too long for ", kind, " (limit ",
                                                   max_bytes, "); is it the right file?"));
  }
  return absl::OkStatus();
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }

 private:
  const int number_;
};

absl::StatusOr<std::string> ReadAll(const std::filesystem::path& file, int descriptor,
                                    std::size_t expected, std::size_t max_bytes,
                                    absl::string_view kind) {
  std::string text(std::min(expected, max_bytes) + 1, '\0');  // one more, to see the end
  std::size_t size = 0;
  while (true) {
    const ssize_t count = ::read(descriptor, text.data() + size, text.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return SystemError(file, errno);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
    if (size > max_bytes) {
      return absl::InvalidArgumentError(absl::StrCat(file.string(), ": is too long for ", kind,
                                                     " (limit ", max_bytes, " bytes)"));
    }
    if (size == text.size()) text.resize(std::min(2 * size, max_bytes + 1));
  }
  text.resize(size);
  return text;
}

}  // namespace

absl::StatusOr<std::string> ReadRegularFile(const std::filesystem::path& file,
                                            std::size_t max_bytes, absl::string_view kind) {
  struct stat what {};
  if (::stat(file.c_str(), &what) != 0) return SystemError(file, errno);
  // Before it is opened: that alone waits at a pipe, and starts some devices.
  if (absl::Status status = Check(file, what, max_bytes, kind); !status.ok()) return status;
  const Descriptor opened(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (opened.number() < 0) return SystemError(file, errno);
  if (::fstat(opened.number(), &what) != 0) return SystemError(file, errno);
  if (absl::Status status = Check(file, what, max_bytes, kind); !status.ok()) return status;
  try {
    return ReadAll(file, opened.number(), static_cast<std::size_t>(what.st_size), max_bytes, kind);
  } catch (const std::bad_alloc&) {
    return absl::DataLossError(absl::StrCat(file.string(), ": no memory for its ", what.st_size,
                                            " bytes; end other programs or raise the limit"));
  }
}

bool MayExist(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::exists(file, error) || error;
}

}  // namespace saccade
