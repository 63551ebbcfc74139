#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <memory>
#include <mutex>

#include "server/mount/drivers/dynamixel_head.hpp"
#include "server/mount/drivers/dynamixel_options.hpp"
#include "server/mount/drivers/threaded_mount.hpp"

namespace saccade {

/// A head of Dynamixel X servos. Its thread owns the line: goals out and readings in, 100 times a
/// second; what is unplugged, switched off or silent is looked for until it is back, and then held
/// where it is until something is demanded. At the end it holds its place, under torque.
class DynamixelMount final : public ThreadedMount {
 public:
  /// InvalidArgument: options. A device or servo that is not there yet is no error: status() says
  /// so, and it may come.
  static absl::StatusOr<std::shared_ptr<DynamixelMount>> Create(const DynamixelOptions& options,
                                                                const MountOptions& mount);
  ~DynamixelMount() override;

  /// Of the motors, newest reading, signed [A] (XL430: load, in units of 2.69 per mille).
  Eigen::Vector3d currents_a() const;

 private:
  DynamixelMount(const DynamixelOptions& options, const MountOptions& mount);
  absl::Status Session(const std::stop_token& stop) override;
  absl::Status Drive(dynamixel::Head& head, const std::stop_token& stop);
  Goal NextGoals();
  void Take(const dynamixel::Head::Joints& joints);

  const DynamixelOptions options_;
  const MountOptions mount_;
  // Own thread.
  Eigen::Vector3d hold_ = Eigen::Vector3d::Zero(), rates_ = Eigen::Vector3d::Zero();
  mutable std::mutex currents_mutex_;
  Eigen::Vector3d currents_ = Eigen::Vector3d::Zero();
};

}  // namespace saccade
