#include "server/mount/dynamixel_mount.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "server/mount/fixed_joint.hpp"

namespace saccade {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kDemandHeld_s = 0.1;  // then the demanded rate counts as zero
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
  made->thread_ = std::jthread([self = made.get()](std::stop_token stop) { self->Run(stop); });
  return made;
}

DynamixelMount::DynamixelMount(const DynamixelOptions& options, const MountOptions& mount)
    : options_(options),
      mount_(mount),
      model_(mount),
      problem_(absl::StrCat("mount ", options.device, ": is being connected")) {}

DynamixelMount::~DynamixelMount() {
  thread_.request_stop();
  wake_.notify_all();
}

absl::Status DynamixelMount::Send(const MountDemand& demand) {
  if (!demand.angles_rad.allFinite() || !demand.rates_rad_s.allFinite() ||
      !(demand.rate_limits_rad_s.minCoeff() >= 0)) {
    return absl::InvalidArgumentError("mount: the demanded angles or rates are not finite");
  }
  const std::lock_guard lock(mutex_);
  if (health_ == MountHealth::kDisconnected) return absl::UnavailableError(problem_);
  demand_ = demand;
  demanded_ns_ = MonotonicNow();
  brake_ = false;
  return absl::OkStatus();
}

void DynamixelMount::Stop() {
  const std::lock_guard lock(mutex_);
  if (!demand_) return;
  demand_.reset();
  brake_ = true;
}

std::optional<EncoderReading> DynamixelMount::Newest() const {
  const std::lock_guard lock(mutex_);
  if (Seconds(MonotonicNow() - read_ns_) > options_.silent_s) return std::nullopt;
  return encoders_.Newest();
}

std::optional<MountAngles> DynamixelMount::AnglesAt(Timestamp time_ns) const {
  const std::lock_guard lock(mutex_);
  return encoders_.At(time_ns);
}

MountStatus DynamixelMount::status() const {
  const std::lock_guard lock(mutex_);
  return {health_, problem_, health_ != MountHealth::kDisconnected && !demand_};
}

Eigen::Vector3d DynamixelMount::currents_a() const {
  const std::lock_guard lock(mutex_);
  return currents_;
}

void DynamixelMount::SetStatus(MountHealth health, const std::string& problem) {
  const std::lock_guard lock(mutex_);
  health_ = health;
  problem_ = problem.empty() ? "" : absl::StrCat("mount: ", problem);
  if (health != MountHealth::kDisconnected) return;
  // Whatever was demanded before is old when it is back.
  demand_.reset();
  brake_ = false;
  encoders_.Clear();
}

bool DynamixelMount::WaitUntil(Clock::time_point time, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  wake_.wait_until(lock, stop, time, [] { return false; });
  return !stop.stop_requested();
}

void DynamixelMount::Run(std::stop_token stop) {
  double retry_s = options_.retry_s;
  while (!stop.stop_requested()) {
    was_up_ = false;
    const absl::Status ended = Session(stop);
    if (stop.stop_requested()) return;
    SetStatus(MountHealth::kDisconnected, std::string(ended.message()));
    if (was_up_) retry_s = options_.retry_s;
    if (!WaitUntil(Clock::now() + Ns(retry_s), stop)) return;
    retry_s = std::min(2 * retry_s, options_.max_retry_s);
  }
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
    const Goals last = NextGoals();
    head.WriteGoals(last.angles_rad, last.rates_rad_s).IgnoreError();
    if (options_.release_at_end) head.Release().IgnoreError();
  }
  return driven;
}

DynamixelMount::Goals DynamixelMount::NextGoals() {
  const std::lock_guard lock(mutex_);
  if (demand_) {
    // Where the demand will be until the next goals go out.
    const double ahead_s = Seconds(MonotonicNow() - demanded_ns_) + 1.0 / options_.update_hz;
    return {demand_->angles_rad + std::min(ahead_s, kDemandHeld_s) * demand_->rates_rad_s,
            demand_->rate_limits_rad_s};
  }
  if (std::exchange(brake_, false)) {
    if (const std::optional<EncoderReading> now = encoders_.Newest()) hold_ = ToVector(now->angles);
    for (int k = 0; k < kMountJoints; ++k) {
      const double most = mount_.joints[static_cast<std::size_t>(k)].max_acceleration_rad_s2;
      hold_(k) += 0.5 * rates_(k) * std::abs(rates_(k)) / most;
    }
  }
  return {hold_, rates_.cwiseAbs().cwiseMax(kHoldRate_rad_s)};
}

void DynamixelMount::Take(const dynamixel::Head::Joints& joints) {
  const std::lock_guard lock(mutex_);
  const auto delay = static_cast<Timestamp>(std::llround(1e9 * mount_.encoder_delay_s));
  encoders_.Add({joints.time_ns - delay, ToAngles(joints.angles_rad)});
  read_ns_ = joints.time_ns;
  rates_ = joints.rates_rad_s;
  currents_ = joints.currents_a;
  if (std::exchange(was_up_, true)) return;
  hold_ = joints.angles_rad;
}

absl::Status DynamixelMount::Drive(dynamixel::Head& head, const std::stop_token& stop) {
  Clock::time_point next = Clock::now(), check = next, heard = next, complete = next;
  std::string fault, silence;
  while (!stop.stop_requested()) {
    if (was_up_) {
      const Goals goals = NextGoals();
      const absl::Status sent = head.WriteGoals(goals.angles_rad, goals.rates_rad_s);
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
    if (was_up_ || !problem.empty())
      SetStatus(problem.empty() ? MountHealth::kReady : MountHealth::kFault, problem);
    next = std::max(next + Ns(1.0 / options_.update_hz), Clock::now());
    if (!WaitUntil(next, stop)) break;
  }
  return absl::OkStatus();
}

}  // namespace saccade
