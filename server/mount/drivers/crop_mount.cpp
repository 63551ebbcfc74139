#include "server/mount/drivers/crop_mount.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>

namespace saccade {
namespace {

constexpr int kSmallest_px = 64;

/// Half of the field of view that is left for the crop's middle to move in.
double Room(double focal_px, int whole_px, int crop_px) {
  return std::atan(0.5 * whole_px / focal_px) - std::atan(0.5 * crop_px / focal_px);
}

}  // namespace

absl::StatusOr<std::shared_ptr<CropMount>> CropMount::Create(const CameraIntrinsics& camera,
                                                             int width, int height) {
  if (width < kSmallest_px || height < kSmallest_px || width >= camera.width ||
      height >= camera.height || width % 2 != 0 || height % 2 != 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--mount: crop:", width, "x", height, " does not fit: give even numbers from ",
        kSmallest_px, "x", kSmallest_px, " to less than ", camera.width, "x", camera.height));
  }
  MountOptions options;
  const double pan = Room(camera.fx, camera.width, width);
  const double elevation = Room(camera.fy, camera.height, height);
  options.of(MountJoint::kPan).min_rad = -pan;
  options.of(MountJoint::kPan).max_rad = pan;
  options.of(MountJoint::kElevation).min_rad = -elevation;
  options.of(MountJoint::kElevation).max_rad = elevation;
  for (JointOptions& joint : options.joints) {
    joint.max_rate_rad_s = 60.0;
    joint.max_acceleration_rad_s2 = 600.0;
  }
  options.encoder_sigma_rad = 0;
  options.command_latency_s = 0;
  CameraIntrinsics view;
  view.width = width;
  view.height = height;
  view.fx = view.fy = camera.fx;
  view.cx = 0.5 * (width - 1);
  view.cy = 0.5 * (height - 1);
  view.fps = camera.fps;
  return std::shared_ptr<CropMount>(new CropMount(MountModel(options), view));
}

absl::Status CropMount::Send(const MountDemand& demand) {
  if (!demand.angles_rad.allFinite()) {
    return absl::InvalidArgumentError("mount: the demanded angles are not finite");
  }
  const std::lock_guard lock(mutex_);
  angles_ = model_.Clamp(ToAngles(demand.angles_rad));
  return absl::OkStatus();
}

std::optional<EncoderReading> CropMount::Newest() const {
  const std::lock_guard lock(mutex_);
  return EncoderReading{MonotonicNow(), angles_};
}

std::optional<MountAngles> CropMount::AnglesAt(Timestamp /*time_ns*/) const {
  // The camera itself never turns: to frames and to the tracker this is a fixed camera.
  return MountAngles{};
}

}  // namespace saccade
