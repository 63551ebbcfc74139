#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

#include "shared/geometry/rigid3.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// Where the mount's base (the wearer's shoulder) will be: constant acceleration, fitted to the
/// last poses by least squares. Fitted to the base and not taken from the tracker, whose velocities
/// are the camera's: they contain the head's own motion, and lag behind it when it starts.
class WearerPredictor {
 public:
  explicit WearerPredictor(double window_s) : window_s_(window_s) {}

  /// Poses come in order of time; one that is not newer is ignored.
  void Add(Timestamp time_ns, const Rigid3& world_from_mount);
  void Clear() { poses_.clear(); }

  std::optional<Timestamp> newest_ns() const;
  /// The newest pose carried on to `time_ns`; nothing before the first pose.
  std::optional<Rigid3> At(Timestamp time_ns) const;
  /// The newest pose as it was, not carried on.
  std::optional<Rigid3> Newest() const;

 private:
  struct Pose {
    Timestamp time_ns;
    Rigid3 world_from_mount;
  };
  void Fit();

  const double window_s_;
  std::deque<Pose> poses_;
  /// Columns: offset, rate, half the acceleration, about the newest pose. Rows: translation in
  /// world, rotation vector in the newest base.
  Eigen::Matrix<double, 6, 3> motion_ = Eigen::Matrix<double, 6, 3>::Zero();
};

}  // namespace saccade
