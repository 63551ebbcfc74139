#pragma once

#include <absl/status/status.h>

#include <string>

#include "server/mount/mount_registry.hpp"

/// The drivers of this folder: NAME_driver.cpp each.
namespace saccade {

MountDriver CropDriver();
MountDriver DynamixelDriver();
MountDriver SimDriver();
MountDriver V4l2Driver();

/// All of them.
MountRegistry MountDrivers();

// For checks.
/// InvalidArgument: a head of motors, or one that plays it, cannot keep up with `--speed max`.
absl::Status NeedsTheClock(const MountFacts& facts);
/// InvalidArgument: `rest` names no device.
absl::Status NeedsADevice(const std::string& rest, const std::string& scheme,
                          const std::string& example);

}  // namespace saccade
