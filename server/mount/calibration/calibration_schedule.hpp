#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/mount/mount.hpp"
#include "server/mount/mount_options.hpp"

namespace saccade {

/// How the head moves while somebody finds out how it is built: slowly enough for the tracker,
/// quickly enough to tell a late encoder from a turned axis.
struct CalibrationMotion {
  double rate_deg_s = 15.0;
  Eigen::Vector3d reach_deg{30.0, 15.0, 20.0};  // by joint, each way, limits permitting
  double combined_s = 20.0;                     // all joints at once
};

/// From where the head is to zero, to and fro with one joint after the other, then all together.
/// Starts and ends at rest. Immutable.
class CalibrationSchedule {
 public:
  CalibrationSchedule(const MountOptions& mount, const MountAngles& start,
                      const CalibrationMotion& motion = {});

  double duration_s() const { return duration_s_; }
  /// Times outside are its beginning and its end.
  MountDemand At(double time_s) const;

 private:
  struct Part {
    double begin_s, end_s;
    Eigen::Vector3d reach_rad, period_s;
  };
  Eigen::Vector3d AnglesAt(double time_s) const;
  void Add(const Eigen::Vector3d& reach_rad, double length_s);

  const double rate_rad_s_;
  const Eigen::Vector3d start_rad_;
  double approach_s_ = 0, duration_s_ = 0;
  std::vector<Part> parts_;
};

}  // namespace saccade
