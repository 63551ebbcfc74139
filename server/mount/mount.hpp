#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <optional>
#include <string>

#include "server/mount/mount_model.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A demanded rate counts for so long, then as zero: a silent server never leaves the head running.
inline constexpr double kDemandHeld_s = 0.1;

/// What the joints shall do, by MountJoint: be at `angles_rad` when the command takes effect, and
/// go on at `rates_rad_s` until the next one. A driver without rate control ignores the rates.
struct MountDemand {
  Eigen::Vector3d angles_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d rates_rad_s = Eigen::Vector3d::Zero();
  /// The motors stay below these whatever they have to catch up with (a servo's profile velocity).
  Eigen::Vector3d rate_limits_rad_s = Eigen::Vector3d::Constant(1e3);
};

/// One reading of the encoders.
struct EncoderReading {
  Timestamp time_ns = 0;  // when the joints were there, capture clock
  MountAngles angles;
};

enum class MountHealth {
  kReady,
  kFault,         // a joint reports an error or does not follow; the others may
  kDisconnected,  // silent; the driver keeps trying
};

struct MountStatus {
  MountHealth health = MountHealth::kReady;
  std::string problem;  // in words, with the joint and the remedy; empty when ready
  /// Stands still under torque: nothing was demanded since it came up, or since Stop.
  bool held = false;
};

/// A mount as gaze control sees it. Thread safe. Drivers do their input and output on a thread of
/// their own and time-stamp what they read on the capture clock; nothing here blocks.
class Mount {
 public:
  virtual ~Mount() = default;

  virtual const MountModel& model() const = 0;

  /// Replaces the demand before. Angles are clamped to the limits, rates to the motor's.
  ///   Unavailable      disconnected: nothing moves until the driver has it back
  ///   InvalidArgument  not finite
  virtual absl::Status Send(const MountDemand& demand) = 0;
  /// Decelerates as fast as the motors may and stays there.
  virtual void Stop() = 0;

  /// The newest reading; nothing before the first, or since the mount went silent.
  virtual std::optional<EncoderReading> Newest() const = 0;
  /// Interpolated between readings; nothing outside what the ring holds (see EncoderRing).
  virtual std::optional<MountAngles> AnglesAt(Timestamp time_ns) const = 0;
  virtual MountStatus status() const = 0;
};

}  // namespace saccade
