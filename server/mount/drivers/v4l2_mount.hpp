#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "server/mount/drivers/threaded_mount.hpp"
#include "server/mount/drivers/v4l2_head.hpp"

namespace saccade {

/// A camera that pans and tilts by V4L2 controls. Its thread talks to the device and looks for it
/// when it is gone. UNTESTED ON HARDWARE: only against a stand-in for the ioctl calls.
class V4l2Mount final : public ThreadedMount {
 public:
  /// The device must be there: what it can decides the model. `open` is for tests.
  ///   NotFound, PermissionDenied, Unavailable, FailedPrecondition: names device and remedy
  static absl::StatusOr<std::shared_ptr<V4l2Mount>> Create(
      const V4l2Options& options, const MountOptions& mount,
      OpenVideoDevice open = OpenRealVideoDevice);
  ~V4l2Mount() override;

 private:
  V4l2Mount(const V4l2Options& options, OpenVideoDevice open, std::unique_ptr<V4l2Head> head);
  absl::Status Session(const std::stop_token& stop) override;
  /// Until the device is gone.
  absl::Status Drive(const std::stop_token& stop);

  const V4l2Options options_;
  const OpenVideoDevice open_;
  // Own thread.
  std::unique_ptr<V4l2Head> head_;  // null: gone
  absl::Status lost_;               // why it went
};

}  // namespace saccade
