#include "server/rpc/live_pem.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace saccade {
namespace {

absl::StatusOr<int> FileOf(const std::string& text) {
  const int fd = ::memfd_create("tls", MFD_CLOEXEC);
  if (fd < 0) return absl::UnavailableError(absl::StrCat("tls: ", std::strerror(errno)));
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = ::write(fd, text.data() + done, text.size() - done);
    if (written <= 0) {
      const int why = errno;
      ::close(fd);
      return absl::UnavailableError(absl::StrCat("tls: ", std::strerror(why)));
    }
    done += static_cast<std::size_t>(written);
  }
  return fd;
}

}  // namespace

absl::StatusOr<std::unique_ptr<LivePem>> LivePem::Make(const std::string& text) {
  const absl::StatusOr<int> fd = FileOf(text);
  if (!fd.ok()) return fd.status();
  return std::unique_ptr<LivePem>(new LivePem(*fd));
}

LivePem::~LivePem() { ::close(fd_); }

std::string LivePem::path() const { return absl::StrCat("/proc/self/fd/", fd_); }

absl::Status LivePem::Set(const std::string& text) {
  const absl::StatusOr<int> fd = FileOf(text);
  if (!fd.ok()) return fd.status();
  const bool put = ::dup3(*fd, fd_, O_CLOEXEC) >= 0;
  ::close(*fd);
  return put ? absl::OkStatus() : absl::UnavailableError("tls: no descriptor");
}

}  // namespace saccade
