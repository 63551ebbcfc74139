#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "server/mount/drivers/dynamixel_bus.hpp"
#include "server/mount/drivers/dynamixel_options.hpp"
#include "server/mount/mount_options.hpp"

namespace saccade::dynamixel {

/// The servos of one head on one open line: joints instead of registers. One thread; blocks as the
/// Bus does. Every error is Unavailable's (the line is gone) or one that ends this attempt.
class Head {
 public:
  /// All must outlive this; options are valid.
  Head(Bus& bus, const DynamixelOptions& options, const MountOptions& mount);

  /// Finds every servo, sets its mode and limits, and holds it where it is, under torque. A servo
  /// with a hardware error stays limp: Check() says so.
  ///   NotFound  no answer: names joint, id, device and remedy
  absl::Status BringUp();

  /// By joint; what is beyond the limits is not.
  absl::Status WriteGoals(const Eigen::Vector3d& angles_rad, const Eigen::Vector3d& rates_rad_s);

  struct Joints {
    Timestamp time_ns = 0;  // middle of the transaction
    Eigen::Vector3d angles_rad = Eigen::Vector3d::Zero(), rates_rad_s = Eigen::Vector3d::Zero();
    Eigen::Vector3d currents_a = Eigen::Vector3d::Zero();
    int answered = 0;
    bool complete = false;    // everybody answered; otherwise the values are not for use
    bool alert = false;       // somebody has a hardware error: Check()
    std::vector<int> silent;  // joints
  };
  absl::StatusOr<Joints> Read();

  /// Torque and hardware errors of all; brings a servo up again that was switched off and on, or
  /// that got over its error. What is wrong, in words; empty: nothing.
  absl::StatusOr<std::string> Check();

  /// "cyclotorsion (servo 3) does not answer; ...".
  std::string SilenceText(int joint) const;
  absl::Status Release();

 private:
  absl::Status BringUpJoint(int joint);
  absl::Status SetUp(int joint, bool& torque);
  absl::Status SetRegister(int id, Register what, std::int64_t value, bool& torque);
  double TicksPerRadian(int joint) const;
  std::int64_t ToTicks(int joint, double angle_rad) const;
  double ToAngle(int joint, std::int64_t ticks) const;
  /// Least and most ticks of the joint's limits.
  std::pair<std::int64_t, std::int64_t> TickLimits(int joint) const;
  std::string Name(int joint) const;

  Bus& bus_;
  const DynamixelOptions& options_;
  const MountOptions& mount_;
  std::vector<int> joints_;  // that have a motor
  std::vector<int> ids_;     // theirs
};

}  // namespace saccade::dynamixel
