#include "shared/io/private_file.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

namespace saccade {
namespace {

// 0 or errno.
int WriteAll(int file, absl::string_view data) {
  while (!data.empty()) {
    const ssize_t written = ::write(file, data.data(), data.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    data.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(file) == 0 ? 0 : errno;
}

}  // namespace

int WritePrivateFile(const std::filesystem::path& file, absl::string_view data) {
  const std::string scratch = absl::StrCat(file.string(), ".", ::getpid(), ".new");
  ::unlink(scratch.c_str());
  const int out =
      ::open(scratch.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (out < 0) return errno;
  int failed = WriteAll(out, data);
  if (::close(out) != 0 && failed == 0) failed = errno;
  if (failed == 0 && ::rename(scratch.c_str(), file.c_str()) != 0) failed = errno;
  if (failed != 0) ::unlink(scratch.c_str());
  return failed;
}

}  // namespace saccade
