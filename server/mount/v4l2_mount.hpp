#pragma once

#include <absl/status/statusor.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "server/mount/encoder_ring.hpp"
#include "server/mount/mount.hpp"
#include "server/mount/v4l2_head.hpp"

namespace saccade {

/// A camera that pans and tilts by V4L2 controls. A thread of its own talks to the device and looks
/// for it when it is gone. UNTESTED ON HARDWARE: only against a stand-in for the ioctl calls.
class V4l2Mount final : public Mount {
 public:
  /// The device must be there: what it can decides the model. `open` is for tests.
  ///   NotFound, PermissionDenied, Unavailable, FailedPrecondition: names device and remedy
  static absl::StatusOr<std::shared_ptr<V4l2Mount>> Create(
      const V4l2Options& options, const MountOptions& mount,
      OpenVideoDevice open = OpenRealVideoDevice);
  ~V4l2Mount() override;

  const MountModel& model() const override { return model_; }
  absl::Status Send(const MountDemand& demand) override;
  void Stop() override;
  std::optional<EncoderReading> Newest() const override;
  std::optional<MountAngles> AnglesAt(Timestamp time_ns) const override;
  MountStatus status() const override;

 private:
  V4l2Mount(const V4l2Options& options, OpenVideoDevice open, std::unique_ptr<V4l2Head> head);
  void Run(const std::stop_token& stop);
  /// Until the device is gone.
  absl::Status Drive(const std::stop_token& stop);
  /// False: stop was requested.
  bool Wait(double seconds, const std::stop_token& stop);
  void Lose(const absl::Status& why);

  const V4l2Options options_;
  const OpenVideoDevice open_;
  std::unique_ptr<V4l2Head> head_;  // own thread
  const MountModel model_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  // Under mutex_.
  std::optional<MountDemand> demand_;  // absent: stays where it is
  Timestamp demanded_ns_ = 0;
  EncoderRing encoders_;
  MountStatus status_{MountHealth::kReady, "", true};
  std::jthread thread_;  // last: it uses everything above
};

}  // namespace saccade
