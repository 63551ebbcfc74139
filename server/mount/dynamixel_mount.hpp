#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "server/mount/dynamixel_head.hpp"
#include "server/mount/dynamixel_options.hpp"
#include "server/mount/encoder_ring.hpp"
#include "server/mount/mount.hpp"

namespace saccade {

/// A head of Dynamixel X servos. A thread of its own owns the line: goals out and readings in, 100
/// times a second; what is unplugged, switched off or silent is looked for until it is back, and
/// then held where it is until something is demanded. At the end it holds its place, under torque.
class DynamixelMount final : public Mount {
 public:
  /// InvalidArgument: options. A device or servo that is not there yet is no error: status() says
  /// so, and it may come.
  static absl::StatusOr<std::shared_ptr<DynamixelMount>> Create(const DynamixelOptions& options,
                                                                const MountOptions& mount);
  ~DynamixelMount() override;

  const MountModel& model() const override { return model_; }
  absl::Status Send(const MountDemand& demand) override;
  void Stop() override;
  std::optional<EncoderReading> Newest() const override;
  std::optional<MountAngles> AnglesAt(Timestamp time_ns) const override;
  MountStatus status() const override;

  /// Of the motors, newest reading, signed [A] (XL430: load, in units of 2.69 per mille).
  Eigen::Vector3d currents_a() const;

 private:
  DynamixelMount(const DynamixelOptions& options, const MountOptions& mount);
  void Run(std::stop_token stop);
  absl::Status Session(const std::stop_token& stop);
  absl::Status Drive(dynamixel::Head& head, const std::stop_token& stop);
  struct Goals {
    Eigen::Vector3d angles_rad, rates_rad_s;
  };
  Goals NextGoals();
  void Take(const dynamixel::Head::Joints& joints);
  void SetStatus(MountHealth health, const std::string& problem);
  /// False: stop was requested.
  bool WaitUntil(std::chrono::steady_clock::time_point time, const std::stop_token& stop);

  const DynamixelOptions options_;
  const MountOptions mount_;
  const MountModel model_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  // Under mutex_.
  std::optional<MountDemand> demand_;  // absent: held at hold_
  Timestamp demanded_ns_ = 0;
  bool brake_ = false;
  Eigen::Vector3d hold_ = Eigen::Vector3d::Zero();
  EncoderRing encoders_;
  Timestamp read_ns_ = 0;  // when the newest reading came
  Eigen::Vector3d rates_ = Eigen::Vector3d::Zero(), currents_ = Eigen::Vector3d::Zero();
  MountHealth health_ = MountHealth::kDisconnected;
  std::string problem_;
  bool was_up_ = false;  // own thread: this session got as far as reading
  std::jthread thread_;  // last: it uses everything above
};

}  // namespace saccade
