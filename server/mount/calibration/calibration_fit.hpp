#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "server/mount/calibration/mount_calibration.hpp"

namespace saccade {

/// The chain that a calibration fits, along the order of the joints (0 is next to the base), in the
/// angles that the present model reads.
struct MountChain {
  std::array<Eigen::Vector3d, kMountJoints> axes, offsets;
  std::array<bool, kMountJoints> moved{};
  Rigid3 world_from_mount;
  double delay_s = 0;  // reading's time stamp minus the picture's, for the same moment

  /// `angles` along the order.
  Rigid3 WorldFromCamera(const Eigen::Vector3d& angles) const;
};

/// Readings, joints along the order, smoothed and interpolated.
class AngleTrack {
 public:
  AngleTrack(const std::vector<EncoderReading>& readings,
             const std::array<MountJoint, kMountJoints>& order);
  /// Outside, the first and the last.
  Eigen::Vector3d At(Timestamp time_ns) const;
  Timestamp begin_ns() const { return times_.front(); }
  Timestamp end_ns() const { return times_.back(); }
  Eigen::Vector3d Range() const;

 private:
  void Smooth();

  std::vector<Timestamp> times_;
  std::vector<Eigen::Vector3d> angles_;
};

struct ChainFit {
  MountChain chain;
  std::array<double, kMountJoints> axis_sigma_rad{};
  double delay_sigma_s = 0;
};

/// Axes by which the camera turns while one joint moves and those after it are near zero; a joint
/// that never moves so keeps the axis that it has.
void GuessAxes(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
               MountChain& chain);

/// Levenberg-Marquardt with Huber weights from `chain` on. `angle_sigma_rad`: of one reading.
ChainFit FitChain(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
                  const MountChain& chain, double angle_sigma_rad, bool metric);

/// Rotation by which `picture` differs from the chain [rad], local.
Eigen::Vector3d RotationResidual(const MountChain& chain, const AngleTrack& track,
                                 const CalibrationData::Picture& picture);

}  // namespace saccade
