#include "server/mount/v4l2_mount.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace saccade {
namespace {

constexpr double kDemandHeld_s = 0.1;  // then the demanded rate counts as zero

}  // namespace

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
  made->thread_ =
      std::jthread([self = made.get()](const std::stop_token& stop) { self->Run(stop); });
  return made;
}

V4l2Mount::V4l2Mount(const V4l2Options& options, OpenVideoDevice open,
                     std::unique_ptr<V4l2Head> head)
    : options_(options),
      open_(std::move(open)),
      head_(std::move(head)),
      model_(head_->mount()),
      // Readings are as rare as commands.
      encoders_(2'000'000'000, static_cast<Timestamp>(4e9 / options.update_hz)) {}

V4l2Mount::~V4l2Mount() {
  thread_.request_stop();
  wake_.notify_all();
}

absl::Status V4l2Mount::Send(const MountDemand& demand) {
  if (!demand.angles_rad.allFinite() || !demand.rates_rad_s.allFinite()) {
    return absl::InvalidArgumentError("mount: the demanded angles or rates are not finite");
  }
  const std::lock_guard lock(mutex_);
  if (status_.health == MountHealth::kDisconnected) {
    return absl::UnavailableError(status_.problem);
  }
  demand_ = demand;
  demanded_ns_ = MonotonicNow();
  status_.held = false;
  return absl::OkStatus();
}

void V4l2Mount::Stop() {
  const std::lock_guard lock(mutex_);
  // Absolute controls know no brake: the place where it is by now is the nearest thing.
  if (const std::optional<EncoderReading> now = encoders_.Newest(); now && demand_) {
    demand_->angles_rad = ToVector(now->angles);
    demand_->rates_rad_s.setZero();
  }
  status_.held = true;
}

std::optional<EncoderReading> V4l2Mount::Newest() const {
  const std::lock_guard lock(mutex_);
  return encoders_.Newest();
}

std::optional<MountAngles> V4l2Mount::AnglesAt(Timestamp time_ns) const {
  const std::lock_guard lock(mutex_);
  return encoders_.At(time_ns);
}

MountStatus V4l2Mount::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

bool V4l2Mount::Wait(double seconds, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, stop, std::chrono::duration<double>(seconds), [] { return false; });
  return !stop.stop_requested();
}

void V4l2Mount::Lose(const absl::Status& why) {
  const std::lock_guard lock(mutex_);
  status_ = {MountHealth::kDisconnected, absl::StrCat("mount: ", why.message()), true};
  demand_.reset();
  encoders_.Clear();
}

absl::Status V4l2Mount::Drive(const std::stop_token& stop) {
  do {
    std::optional<Eigen::Vector3d> goal;
    const Timestamp now = MonotonicNow();
    {
      const std::lock_guard lock(mutex_);
      if (demand_) {
        const double age_s = std::min(Seconds(now - demanded_ns_), kDemandHeld_s);
        goal = demand_->angles_rad + age_s * demand_->rates_rad_s;
      }
    }
    const absl::Status stepped = head_->Step(now, goal.value_or(head_->angles_rad()));
    if (absl::IsUnavailable(stepped)) return stepped;
    const std::lock_guard lock(mutex_);
    status_.health = stepped.ok() ? MountHealth::kReady : MountHealth::kFault;
    status_.problem = stepped.ok() ? "" : absl::StrCat("mount: ", stepped.message());
    const auto delay = static_cast<Timestamp>(std::llround(1e9 * model_.options().encoder_delay_s));
    encoders_.Add({now - delay, ToAngles(head_->angles_rad())});
  } while (Wait(1.0 / options_.update_hz, stop));
  return absl::OkStatus();
}

void V4l2Mount::Run(const std::stop_token& stop) {
  double retry_s = options_.retry_s;
  while (!stop.stop_requested()) {
    if (head_ != nullptr) {
      const absl::Status driven = Drive(stop);
      if (driven.ok()) return;  // stopped
      Lose(driven);
      head_.reset();
      retry_s = options_.retry_s;
    }
    if (!Wait(retry_s, stop)) return;
    retry_s = std::min(2 * retry_s, options_.max_retry_s);
    absl::StatusOr<std::unique_ptr<VideoDevice>> device = open_(options_.device);
    if (!device.ok()) continue;
    // The limits stay those of the first time: others have taken them over.
    absl::StatusOr<std::unique_ptr<V4l2Head>> head =
        V4l2Head::Open(options_, model_.options(), *std::move(device));
    if (head.ok()) {
      head_ = *std::move(head);
    } else {
      Lose(head.status());
    }
  }
}

}  // namespace saccade
