#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <filesystem>
#include <string>

#include "server/mount/mount_angles.hpp"

namespace saccade {

/// The motor of one joint. Direction and zero are the joint's encoder_sign and encoder_zero_deg
/// (MountOptions); raw angles count from `centre_tick`.
struct DynamixelServo {
  int id = -1;                   // -1: the joint has no motor and stays at 0
  double ticks_per_turn = 4096;  // of the joint: behind a gear its ratio times as many
  int centre_tick = 2048;        // where its raw angle is 0
};

/// A head of Dynamixel X servos (Protocol 2.0) on one serial line.
struct DynamixelOptions {
  std::string device;  // from the URI, e.g. /dev/ttyUSB0, or better a link of /dev/serial/by-id
  int baud = 57600;    // as the servos leave the factory; 1000000 leaves room for 100 Hz
  std::array<DynamixelServo, kMountJoints> servos = {
      DynamixelServo{.id = 1}, DynamixelServo{.id = 2}, DynamixelServo{.id = 3}};  // by MountJoint
  double update_hz = 100;           // goals and readings per second, if the line is quick enough
  double answer_timeout_s = 0.025;  // beyond the time on the wire: USB adapters wait for 16 ms
  double silent_s = 0.3;            // without answers: a joint is at fault, the mount is gone
  double retry_s = 0.2, max_retry_s = 2.0;  // between attempts to reconnect, doubled each time
  bool release_at_end = false;              // torque off when the server ends: the head may drop

  /// InvalidArgument names the field, its value and what it may be.
  absl::Status Validate() const;
  /// Reads the [dynamixel] table (docs/configuration.md lists the keys); a file without one changes
  /// nothing.
  absl::Status LoadToml(const std::filesystem::path& file);
  /// That table with all defaults, each key with its range and meaning.
  static std::string Describe();
  /// What follows "dynamixel:": DEVICE[?baud=N]. It wins over the file.
  absl::Status ReadUri(const std::string& rest);
};

}  // namespace saccade
