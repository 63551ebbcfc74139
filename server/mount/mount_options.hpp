#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <numbers>
#include <string>

#include "server/mount/mount_angles.hpp"

namespace saccade {

/// One axis of a mount.
struct JointOptions {
  /// Unit vector that the joint turns about (right-handed), in the frame of the link before it with
  /// all joints at zero. Defaults by joint: +y pan (to the right), +x elevation (up), +z
  /// cyclotorsion (clockwise as the camera sees it).
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();
  /// From this axis to the next one, or from the last to the optic centre, in the turned frame [m].
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  double min_rad = -std::numbers::pi, max_rad = std::numbers::pi;
  double max_rate_rad_s = 6.0;            // the motor's own; gaze is slower unless asked
  double max_acceleration_rad_s2 = 60.0;  // the motor's own
  int encoder_sign = 1;                   // of raw angles against ours: +1 or -1
  double encoder_zero_rad = 0;            // raw angle at our zero

  double ToRaw(double angle_rad) const { return encoder_sign * angle_rad + encoder_zero_rad; }
  double FromRaw(double raw_rad) const { return encoder_sign * (raw_rad - encoder_zero_rad); }
};

/// Geometry and abilities of a pan/elevation/cyclotorsion mount (slam-spec section 8).
struct MountOptions {
  /// From the mount base outwards: R_SC = R(order[0]) R(order[1]) R(order[2]).
  std::array<MountJoint, kMountJoints> order = {MountJoint::kPan, MountJoint::kElevation,
                                                MountJoint::kCyclotorsion};
  std::array<JointOptions, kMountJoints> joints = DefaultJoints();  // by MountJoint
  double encoder_sigma_rad = 0.1 * std::numbers::pi / 180.0;        // of one reading
  /// By how much the encoders' time stamps are late against the pictures': drivers take it off.
  double encoder_delay_s = 0.0;
  double command_latency_s = 0.02;  // from Send to the first motion; calibrate-mount measures it

  const JointOptions& of(MountJoint joint) const { return joints[static_cast<std::size_t>(joint)]; }
  JointOptions& of(MountJoint joint) { return joints[static_cast<std::size_t>(joint)]; }

  /// InvalidArgument names the field, its value and what it may be.
  absl::Status Validate() const;
  /// Reads the [mount_model] table of a TOML file over the present values (docs/configuration.md
  /// lists the keys); a file without one changes nothing.
  ///   NotFound         no such file
  ///   InvalidArgument  not TOML, unknown key, wrong type or range: names file, key and remedy
  absl::Status LoadToml(const std::filesystem::path& file);
  /// That table with all defaults, each key with its range and meaning.
  static std::string Describe();

 private:
  static std::array<JointOptions, kMountJoints> DefaultJoints();
};

/// "pan", "elevation", "cyclotorsion".
const char* ToString(MountJoint joint);

/// The [mount_model] table that LoadToml reads back to the same options (to 1e-9).
std::string ToToml(const MountOptions& options);

}  // namespace saccade
