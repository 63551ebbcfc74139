#pragma once

#include <optional>

#include "server/mount/mount_model.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// What a simulated camera needs to know of the head that carries it. Thread safe.
class SimulatedHead {
 public:
  virtual ~SimulatedHead() = default;
  /// What everybody believes of it.
  virtual const MountModel& model() const = 0;
  /// What it really is: differs where somebody has to find out (calibrate-mount).
  virtual const MountModel& true_model() const { return model(); }
  /// The head has moved up to `time_ns` when this returns.
  virtual void AdvanceTo(Timestamp time_ns) = 0;
  /// Where it really was.
  virtual MountAngles TrueAngles(Timestamp time_ns) const = 0;
  /// What its encoders said, interpolated; nothing while they are silent.
  virtual std::optional<MountAngles> ReadAngles(Timestamp time_ns) const = 0;
};

}  // namespace saccade
