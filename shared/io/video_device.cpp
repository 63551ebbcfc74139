#include "shared/io/video_device.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

namespace saccade {
namespace {

class RealDevice final : public CaptureDevice {
 public:
  explicit RealDevice(int file) : file_(file) {}
  ~RealDevice() override {
    for (const auto& [memory, length] : maps_) munmap(memory, length);
    close(file_);
  }
  int Ioctl(unsigned long request, void* argument) override {
    int result = 0;
    do {
      result = ioctl(file_, request, argument);
    } while (result != 0 && errno == EINTR);
    return result == 0 ? 0 : errno;
  }
  int Map(std::size_t length, std::uint32_t offset, std::span<const std::uint8_t>* out) override {
    void* memory = mmap(nullptr, length, PROT_READ, MAP_SHARED, file_, offset);
    if (memory == MAP_FAILED) return errno;
    maps_.emplace_back(memory, length);
    *out = {static_cast<const std::uint8_t*>(memory), length};
    return 0;
  }
  int Wait(int most_ms) override {
    pollfd poll_for{file_, POLLIN, 0};
    const int ready = poll(&poll_for, 1, most_ms);
    if (ready < 0) return errno == EINTR ? ETIMEDOUT : errno;
    if (ready == 0) return ETIMEDOUT;
    return (poll_for.revents & POLLIN) != 0 ? 0 : ENODEV;
  }

 private:
  const int file_;
  std::vector<std::pair<void*, std::size_t>> maps_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<CaptureDevice>> OpenRealCaptureDevice(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file >= 0) return std::make_unique<RealDevice>(file);
  if (errno == ENOENT || errno == ENODEV || errno == ENXIO) {
    return absl::NotFoundError(absl::StrCat(path, ": no such device; plug the camera in"));
  }
  if (errno == EACCES) {
    return absl::PermissionDeniedError(
        absl::StrCat(path, ": may not be opened; add the user to the group that owns it (video)"));
  }
  return absl::UnavailableError(
      absl::StrCat(path, ": cannot be opened (", std::strerror(errno), "); is it a camera?"));
}

absl::StatusOr<std::unique_ptr<VideoDevice>> OpenRealVideoDevice(const std::string& path) {
  return OpenRealCaptureDevice(path);
}

}  // namespace saccade
