#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "server/mount/mount.hpp"
#include "server/mount/mount_options.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// What was seen while the head moved and its base stood still.
struct CalibrationData {
  struct Picture {
    Timestamp time_ns = 0;  // mid-exposure
    Rigid3 world_from_camera;
    double rotation_sigma_rad = 0.002, position_sigma_m = 0.01;  // of the tracker, one axis
  };
  struct Demand {
    Timestamp time_ns = 0;  // of Send
    Eigen::Vector3d angles_rad = Eigen::Vector3d::Zero();
  };
  // Each in order of time. Readings and demands as the present model turns raw angles into ours.
  std::vector<Picture> pictures;
  std::vector<EncoderReading> readings;
  std::vector<Demand> demands;
  bool metric = true;  // false: positions mean nothing, offsets stay as they are
};

struct MountCalibration {
  MountOptions mount;  // found: axes, offsets, signs, zeros, delay, latency
  struct Joint {
    bool moved = false;  // false: left as it was
    double range_rad = 0;
    double turned_rad = 0;  // by how much the axis differs from the one before, signs apart
    double axis_sigma_rad = 0;
    bool sign_flipped = false;
    double zero_shift_rad = 0;
  };
  std::array<Joint, kMountJoints> joints;  // by MountJoint
  // Residuals of the camera's orientation: by the model before, by the one found.
  double orientation_rms_before_rad = 0, orientation_rms_rad = 0, orientation_max_rad = 0;
  double position_rms_m = 0;   // 0: not metric
  double encoder_delay_s = 0;  // all of it, as in `mount`
  double encoder_delay_sigma_s = 0;
  double command_latency_s = 0;  // from Send to the motion, servo lag included
  int pictures = 0, outliers = 0;
};

/// Finds axes, link offsets, encoder signs and zeros, and delays from the camera's poses beside the
/// encoders' readings, by robust nonlinear least squares (docs/derivations/mount.md). Pure;
/// deterministic.
///   FailedPrecondition  too few pictures or readings, nothing moved, or the residuals are beyond
///                       what a standing base can cause: says which, and the remedy
absl::StatusOr<MountCalibration> CalibrateMount(const CalibrationData& data,
                                                const MountOptions& present);

}  // namespace saccade
