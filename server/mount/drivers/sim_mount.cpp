#include "server/mount/drivers/sim_mount.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/mount/approach.hpp"

namespace saccade {
namespace {

constexpr Timestamp kStepNs = 1'000'000;
constexpr double kStep_s = 1e-3;
constexpr std::size_t kHistory = 3000;  // steps
constexpr double kNotFollowing_rad = 0.05;
constexpr int kNotFollowing_ms = 300;

}  // namespace

MountOptions CrookedMount(std::uint64_t seed) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> part(-1, 1);
  MountOptions mount;
  const auto straight = static_cast<MountJoint>(seed % kMountJoints);  // keeps its sign
  for (int k = 0; k < kMountJoints; ++k) {
    JointOptions& joint = mount.of(static_cast<MountJoint>(k));
    const Eigen::Vector3d across =
        joint.axis.cross(Eigen::Vector3d(part(rng), part(rng), part(rng)) + joint.axis * 2.0 +
                         Eigen::Vector3d::Constant(0.3));
    const double tilt = (3 + part(rng)) * kDegree;
    joint.axis = Eigen::AngleAxisd(tilt, across.normalized()) * joint.axis;
    joint.offset_m = 0.03 * Eigen::Vector3d(part(rng), part(rng), part(rng));
    if (static_cast<MountJoint>(k) != straight) joint.encoder_sign = -1;
    if (k > 0) joint.encoder_zero_rad = 6 * part(rng) * kDegree;
  }
  mount.encoder_delay_s = 0.035;
  mount.command_latency_s = 0.06;
  return mount;
}

SimMount::SimMount(const SimMountOptions& options)
    : options_(options),
      head_(options.truth.value_or(options.mount)),
      model_(options.mount),
      true_model_(head_),
      rng_(options.seed) {}

void SimMount::Sync() const {
  if (options_.wall_clock) const_cast<SimMount*>(this)->Advance(MonotonicNow());
}

void SimMount::AdvanceTo(Timestamp time_ns) {
  const std::lock_guard lock(mutex_);
  Advance(time_ns);
}

void SimMount::Advance(Timestamp time_ns) {
  if (!now_ns_) {
    now_ns_ = time_ns;
    next_reading_ns_ = time_ns;
    history_.push_back(Eigen::Vector3d::Zero());
    ReadEncoders();
  }
  while (*now_ns_ + kStepNs <= time_ns) {
    *now_ns_ += kStepNs;
    Step();
    ReadEncoders();
  }
}

void SimMount::Step() {
  while (!pending_.empty() && pending_.front().effect_ns <= *now_ns_) {
    active_ = pending_.front();
    pending_.pop_front();
  }
  const double age_s = std::min(Seconds(*now_ns_ - active_.effect_ns), kDemandHeld_s);
  const bool fresh = age_s < kDemandHeld_s;
  for (int k = 0; k < kMountJoints; ++k) {
    Joint& joint = joints_[static_cast<std::size_t>(k)];
    if (joint.stuck || unplugged_) joint.rate = 0;
    if (unplugged_) continue;
    if (active_.brake) {
      // Full deceleration, and hold: the reference is where it would come to rest.
      const double a = head_.joints[static_cast<std::size_t>(k)].max_acceleration_rad_s2;
      if (joint.stuck) continue;
      joint.rate -= std::clamp(joint.rate, -a * kStep_s, a * kStep_s);
      joint.angle += joint.rate * kStep_s;
      continue;
    }
    const double rate = active_.demand.rates_rad_s(k);
    StepJoint(k, active_.demand.angles_rad(k) + rate * age_s, fresh ? rate : 0.0);
  }
  history_.push_back({joints_[0].angle, joints_[1].angle, joints_[2].angle});
  if (history_.size() > kHistory) history_.pop_front();
}

void SimMount::StepJoint(int index, double reference, double rate) {
  Joint& joint = joints_[static_cast<std::size_t>(index)];
  const JointOptions& limits = head_.joints[static_cast<std::size_t>(index)];
  const double error = std::clamp(reference, limits.min_rad, limits.max_rad) - joint.angle;
  joint.behind_ms =
      std::abs(error) > kNotFollowing_rad && std::abs(joint.rate) < 1e-3 ? joint.behind_ms + 1 : 0;
  if (joint.stuck) return;
  const double a = limits.max_acceleration_rad_s2;
  const double most = std::min(limits.max_rate_rad_s, active_.demand.rate_limits_rad_s(index));
  const double wanted =
      std::clamp(rate + ApproachRate(error, a, options_.servo_gain_per_s), -most, most);
  joint.rate += std::clamp(wanted - joint.rate, -a * kStep_s, a * kStep_s);
  joint.angle += joint.rate * kStep_s;
  if (joint.angle < limits.min_rad || joint.angle > limits.max_rad) {
    joint.angle = std::clamp(joint.angle, limits.min_rad, limits.max_rad);
    joint.rate = 0;
  }
}

void SimMount::ReadEncoders() {
  if (*now_ns_ < next_reading_ns_) return;
  next_reading_ns_ += static_cast<Timestamp>(std::llround(1e9 / options_.encoder_hz));
  if (unplugged_) return;
  Eigen::Vector3d read = history_.back();
  for (int k = 0; k < kMountJoints; ++k) {
    const auto joint = static_cast<MountJoint>(k);
    read(k) += head_.encoder_sigma_rad * normal_(rng_);
    read(k) = options_.mount.of(joint).FromRaw(head_.of(joint).ToRaw(read(k)));
  }
  const double late_s = head_.encoder_delay_s - options_.mount.encoder_delay_s;
  encoders_.Add({*now_ns_ + static_cast<Timestamp>(std::llround(1e9 * late_s)), ToAngles(read)});
}

absl::Status SimMount::Send(const MountDemand& demand) {
  if (!demand.angles_rad.allFinite() || !demand.rates_rad_s.allFinite() ||
      !(demand.rate_limits_rad_s.minCoeff() >= 0)) {
    return absl::InvalidArgumentError("mount: the demanded angles or rates are not finite");
  }
  const std::lock_guard lock(mutex_);
  Sync();
  if (unplugged_) return absl::UnavailableError("mount sim: disconnected: plug it in again");
  Pending pending{.effect_ns = now_ns_.value_or(0) +
                               static_cast<Timestamp>(std::llround(1e9 * head_.command_latency_s)),
                  .demand = demand,
                  .brake = false};
  pending.demand.angles_rad = ToVector(model_.Clamp(ToAngles(demand.angles_rad)));
  for (int k = 0; k < kMountJoints; ++k) {
    const JointOptions& told = options_.mount.of(static_cast<MountJoint>(k));
    const JointOptions& real = head_.of(static_cast<MountJoint>(k));
    pending.demand.angles_rad(k) = real.FromRaw(told.ToRaw(pending.demand.angles_rad(k)));
    pending.demand.rates_rad_s(k) *= told.encoder_sign * real.encoder_sign;
  }
  pending_.push_back(pending);
  return absl::OkStatus();
}

void SimMount::Stop() {
  const std::lock_guard lock(mutex_);
  Sync();
  pending_.clear();  // a stop overtakes what is still on its way
  active_.brake = true;
}

std::optional<EncoderReading> SimMount::Newest() const {
  const std::lock_guard lock(mutex_);
  Sync();
  return unplugged_ ? std::nullopt : encoders_.Newest();
}

std::optional<MountAngles> SimMount::AnglesAt(Timestamp time_ns) const {
  const std::lock_guard lock(mutex_);
  Sync();
  return encoders_.At(time_ns);
}

MountStatus SimMount::status() const {
  const std::lock_guard lock(mutex_);
  Sync();
  if (unplugged_) {
    return {MountHealth::kDisconnected, "mount sim: disconnected: plug it in again"};
  }
  for (int k = 0; k < kMountJoints; ++k) {
    if (joints_[static_cast<std::size_t>(k)].behind_ms < kNotFollowing_ms) continue;
    return {MountHealth::kFault, absl::StrCat("mount sim: ", ToString(static_cast<MountJoint>(k)),
                                              " does not follow: free the joint")};
  }
  return {MountHealth::kReady, "", active_.brake};
}

MountAngles SimMount::TrueAngles(Timestamp time_ns) const {
  const std::lock_guard lock(mutex_);
  if (history_.empty()) return {};
  const double back = static_cast<double>(*now_ns_ - time_ns) / static_cast<double>(kStepNs);
  const double at = std::clamp(static_cast<double>(history_.size() - 1) - back, 0.0,
                               static_cast<double>(history_.size() - 1));
  const auto before = static_cast<std::size_t>(at);
  const std::size_t after = std::min(before + 1, history_.size() - 1);
  const double share = at - static_cast<double>(before);
  return ToAngles((1 - share) * history_[before] + share * history_[after]);
}

void SimMount::SetUnplugged(bool unplugged) {
  const std::lock_guard lock(mutex_);
  Sync();
  if (unplugged_ && !unplugged) active_.brake = true;
  unplugged_ = unplugged;
  pending_.clear();
  if (unplugged) encoders_.Clear();
}

void SimMount::SetStuck(MountJoint joint, bool stuck) {
  const std::lock_guard lock(mutex_);
  joints_[static_cast<std::size_t>(joint)].stuck = stuck;
}

}  // namespace saccade
