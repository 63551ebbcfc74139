#include "server/mount/drivers/dynamixel_mount.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "server/mount/fixed_joint.hpp"

namespace saccade {
namespace {

constexpr double kCheckEvery_s = 0.1;  // torque and hardware errors
constexpr double kHoldRate_rad_s = 0.5;

std::chrono::nanoseconds Ns(double seconds) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * seconds));
}

/// Joints without a motor stay at zero, and gaze knows it.
MountOptions WithMotors(MountOptions mount, const DynamixelOptions& options) {
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    if (options.servos[k].id < 0) FixJoint(mount.joints[k]);
  }
  return mount;
}

}  // namespace

absl::StatusOr<std::shared_ptr<DynamixelMount>> DynamixelMount::Create(
    const DynamixelOptions& options, const MountOptions& mount) {
  if (absl::Status valid = options.Validate(); !valid.ok()) return valid;
  if (absl::Status valid = mount.Validate(); !valid.ok()) return valid;
  std::shared_ptr<DynamixelMount> made(new DynamixelMount(options, WithMotors(mount, options)));
  made->Start();
  return made;
}

DynamixelMount::DynamixelMount(const DynamixelOptions& options, const MountOptions& mount)
    : ThreadedMount(mount,
                    {.retry_s = options.retry_s,
                     .max_retry_s = options.max_retry_s,
                     .silent_s = options.silent_s},
                    {MountHealth::kDisconnected,
                     absl::StrCat("mount ", options.device, ": is being connected"), false}),
      options_(options),
      mount_(mount) {}

DynamixelMount::~DynamixelMount() { End(); }

Eigen::Vector3d DynamixelMount::currents_a() const {
  const std::lock_guard lock(currents_mutex_);
  return currents_;
}

absl::Status DynamixelMount::Session(const std::stop_token& stop) {
  absl::StatusOr<std::unique_ptr<SerialLine>> line =
      SerialLine::Open(options_.device, options_.baud);
  if (!line.ok()) return line.status();
  dynamixel::Bus bus(**line, options_.baud, options_.answer_timeout_s);
  dynamixel::Head head(bus, options_, mount_);
  if (absl::Status up = head.BringUp(); !up.ok()) return up;
  const absl::Status driven = Drive(head, stop);
  if (stop.stop_requested() && driven.ok()) {
    Stop();
    const Goal last = NextGoals();
    head.WriteGoals(last.angles_rad, last.rate_limits_rad_s).IgnoreError();
    if (options_.release_at_end) head.Release().IgnoreError();
  }
  return driven;
}

DynamixelMount::Goal DynamixelMount::NextGoals() {
  // Where the demand will be until the next goals go out.
  if (const std::optional<Goal> demanded = Demanded(1.0 / options_.update_hz)) return *demanded;
  if (TakeBrake()) {
    if (const std::optional<EncoderReading> now = LastReading()) hold_ = ToVector(now->angles);
    for (int k = 0; k < kMountJoints; ++k) {
      const double most = mount_.joints[static_cast<std::size_t>(k)].max_acceleration_rad_s2;
      hold_(k) += 0.5 * rates_(k) * std::abs(rates_(k)) / most;
    }
  }
  return {hold_, rates_.cwiseAbs().cwiseMax(kHoldRate_rad_s)};
}

void DynamixelMount::Take(const dynamixel::Head::Joints& joints) {
  if (!has_reading()) hold_ = joints.angles_rad;
  AddReading(joints.time_ns, joints.angles_rad);
  rates_ = joints.rates_rad_s;
  const std::lock_guard lock(currents_mutex_);
  currents_ = joints.currents_a;
}

absl::Status DynamixelMount::Drive(dynamixel::Head& head, const std::stop_token& stop) {
  Clock::time_point next = Clock::now(), check = next, heard = next, complete = next;
  std::string fault, silence;
  while (!stop.stop_requested()) {
    if (has_reading()) {
      const Goal goal = NextGoals();
      const absl::Status sent = head.WriteGoals(goal.angles_rad, goal.rate_limits_rad_s);
      if (!sent.ok()) return sent;
    }
    const absl::StatusOr<dynamixel::Head::Joints> joints = head.Read();
    if (!joints.ok()) return joints.status();
    const Clock::time_point now = Clock::now();
    if (joints->answered > 0) heard = now;
    if (joints->complete) {
      complete = now;
      silence.clear();
      Take(*joints);
    } else if (now > heard + Ns(options_.silent_s)) {
      return absl::UnavailableError(absl::StrCat(
          options_.device, ": no servo answers any more; check the servos' power and cable"));
    } else if (now > complete + Ns(options_.silent_s)) {
      silence = head.SilenceText(joints->silent.front());
    }
    if (joints->answered > 0 && ((joints->alert && fault.empty()) || now >= check)) {
      absl::StatusOr<std::string> found = head.Check();
      if (!found.ok()) return found.status();
      fault = *std::move(found);
      check = now + Ns(kCheckEvery_s);
    }
    const std::string& problem = silence.empty() ? fault : silence;
    if (has_reading() || !problem.empty()) Report(problem);
    next = std::max(next + Ns(1.0 / options_.update_hz), Clock::now());
    if (!WaitUntil(next, stop)) break;
  }
  return absl::OkStatus();
}

}  // namespace saccade
