#include "server/mount/drivers/v4l2_mount.hpp"

#include <chrono>
#include <utility>

namespace saccade {

absl::StatusOr<std::shared_ptr<V4l2Mount>> V4l2Mount::Create(const V4l2Options& options,
                                                             const MountOptions& mount,
                                                             OpenVideoDevice open) {
  if (absl::Status valid = options.Validate(); !valid.ok()) return valid;
  if (absl::Status valid = mount.Validate(); !valid.ok()) return valid;
  absl::StatusOr<std::unique_ptr<VideoDevice>> device = open(options.device);
  if (!device.ok()) return device.status();
  absl::StatusOr<std::unique_ptr<V4l2Head>> head =
      V4l2Head::Open(options, mount, *std::move(device));
  if (!head.ok()) return head.status();
  std::shared_ptr<V4l2Mount> made(new V4l2Mount(options, std::move(open), *std::move(head)));
  made->Start();
  return made;
}

V4l2Mount::V4l2Mount(const V4l2Options& options, OpenVideoDevice open,
                     std::unique_ptr<V4l2Head> head)
    : ThreadedMount(
          head->mount(),
          {.retry_s = options.retry_s,
           .max_retry_s = options.max_retry_s,
           // Readings are as rare as commands.
           .encoders = EncoderRing(2'000'000'000, static_cast<Timestamp>(4e9 / options.update_hz))},
          {MountHealth::kReady, "", true}),
      options_(options),
      open_(std::move(open)),
      head_(std::move(head)) {}

V4l2Mount::~V4l2Mount() { End(); }

absl::Status V4l2Mount::Drive(const std::stop_token& stop) {
  std::optional<Eigen::Vector3d> hold;
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(1.0 / options_.update_hz));
  do {
    const std::optional<Goal> demanded = Demanded(0);
    // Absolute controls know no brake: the place where it is by now is the nearest thing.
    if (TakeBrake()) hold = head_->angles_rad();
    const Eigen::Vector3d rest = hold.value_or(head_->angles_rad());
    const Timestamp now = MonotonicNow();
    const absl::Status stepped = head_->Step(now, demanded ? demanded->angles_rad : rest);
    if (absl::IsUnavailable(stepped)) return stepped;
    Report(std::string(stepped.message()));
    AddReading(now, head_->angles_rad());
  } while (WaitUntil(Clock::now() + period, stop));
  return absl::OkStatus();
}

absl::Status V4l2Mount::Session(const std::stop_token& stop) {
  if (head_ == nullptr) {
    absl::StatusOr<std::unique_ptr<VideoDevice>> device = open_(options_.device);
    if (!device.ok()) return lost_;  // still gone
    // The limits stay those of the first time: others have taken them over.
    absl::StatusOr<std::unique_ptr<V4l2Head>> head =
        V4l2Head::Open(options_, model().options(), *std::move(device));
    if (!head.ok()) return lost_ = head.status();
    head_ = *std::move(head);
  }
  lost_ = Drive(stop);
  if (!lost_.ok()) head_.reset();
  return lost_;
}

}  // namespace saccade
