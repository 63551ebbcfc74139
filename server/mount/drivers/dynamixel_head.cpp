#include "server/mount/drivers/dynamixel_head.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace saccade::dynamixel {
namespace {

// Control table of the X series (manual, "Control Table").
constexpr Register kOperatingMode{11, 1};
constexpr Register kMaxPosition{48, 4}, kMinPosition{52, 4};
constexpr Register kTorqueEnable{64, 1};
constexpr Register kStatusReturnLevel{68, 1};
constexpr Register kHardwareError{70, 1};
constexpr Register kProfileAcceleration{108, 4};
constexpr Register kProfileVelocity{112, 4};  // the goal follows it: written together
constexpr Register kGoalPosition{116, 4};
constexpr int kGoalSize = 8;
constexpr Register kPresentCurrent{126, 2};  // velocity and position follow it: read together
constexpr Register kPresentPosition{132, 4};
constexpr int kPresentSize = 10;
constexpr int kStateSize = kHardwareError.address + 1 - kTorqueEnable.address;

constexpr std::int64_t kPositionMode = 3, kExtendedPositionMode = 4;
constexpr std::int64_t kOneTurn = 4095;  // position mode knows 0 to this
constexpr double kTicksPerTurn = 4096;   // of the servo's own shaft, for its units of speed
constexpr double kVelocityUnit_turn_s = 0.229 / 60.0;
constexpr double kAccelerationUnit_turn_s2 = 214.577 / 3600.0;
constexpr double kCurrentUnit_a = 2.69e-3;
constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kGentle_rad_s = 10.0 * std::numbers::pi / 180.0;

std::string HardwareText(std::int64_t error) {
  struct Bit {
    int bit;
    const char* text;
  };
  constexpr Bit kBits[] = {{0, "input voltage out of range; check the supply"},
                           {2, "too hot; let it cool"},
                           {3, "its encoder or motor fails; replace it"},
                           {4, "electrical shock or too little power; check the supply"},
                           {5, "overload; free the joint"}};
  std::string text;
  for (const Bit& each : kBits) {
    if ((error >> each.bit & 1) != 0) absl::StrAppend(&text, text.empty() ? "" : "; ", each.text);
  }
  if (text.empty()) text = absl::StrCat("hardware error ", error);
  return absl::StrCat(text, ", then switch its power off and on");
}

}  // namespace

Head::Head(Bus& bus, const DynamixelOptions& options, const MountOptions& mount)
    : bus_(bus), options_(options), mount_(mount) {
  for (int joint = 0; joint < kMountJoints; ++joint) {
    const int id = options.servos[static_cast<std::size_t>(joint)].id;
    if (id < 0) continue;
    joints_.push_back(joint);
    ids_.push_back(id);
  }
}

std::string Head::Name(int joint) const {
  return absl::StrCat(ToString(static_cast<MountJoint>(joint)), " (servo ",
                      options_.servos[static_cast<std::size_t>(joint)].id, ")");
}

std::string Head::SilenceText(int joint) const {
  return absl::StrCat(Name(joint), " does not answer on ", options_.device, " at ", options_.baud,
                      " baud; check its power and cable, dynamixel.",
                      ToString(static_cast<MountJoint>(joint)), ".id and the baud rate");
}

double Head::TicksPerRadian(int joint) const {
  return options_.servos[static_cast<std::size_t>(joint)].ticks_per_turn / kTwoPi;
}

std::int64_t Head::ToTicks(int joint, double angle_rad) const {
  const DynamixelServo& servo = options_.servos[static_cast<std::size_t>(joint)];
  const double raw = mount_.of(static_cast<MountJoint>(joint)).ToRaw(angle_rad);
  return servo.centre_tick + std::llround(raw * TicksPerRadian(joint));
}

double Head::ToAngle(int joint, std::int64_t ticks) const {
  const DynamixelServo& servo = options_.servos[static_cast<std::size_t>(joint)];
  const double raw = static_cast<double>(ticks - servo.centre_tick) / TicksPerRadian(joint);
  return mount_.of(static_cast<MountJoint>(joint)).FromRaw(raw);
}

std::pair<std::int64_t, std::int64_t> Head::TickLimits(int joint) const {
  const JointOptions& limits = mount_.of(static_cast<MountJoint>(joint));
  return std::minmax({ToTicks(joint, limits.min_rad), ToTicks(joint, limits.max_rad)});
}

absl::Status Head::SetRegister(int id, Register what, std::int64_t value, bool& torque) {
  const absl::StatusOr<std::int64_t> now = bus_.Read(id, what);
  if (!now.ok()) return now.status();
  if (*now == value) return absl::OkStatus();
  if (torque) {  // these registers are writable only without
    if (absl::Status off = bus_.Write(id, kTorqueEnable, 0); !off.ok()) return off;
    torque = false;
  }
  if (absl::Status written = bus_.Write(id, what, value); !written.ok()) return written;
  const absl::StatusOr<std::int64_t> kept = bus_.Read(id, what);
  if (kept.ok() && *kept != value) {
    return absl::FailedPreconditionError(absl::StrCat("servo ", id, ": register ", what.address,
                                                      " stays ", *kept, " instead of ", value));
  }
  return kept.status();
}

absl::Status Head::SetUp(int joint, bool& torque) {
  const int id = options_.servos[static_cast<std::size_t>(joint)].id;
  const auto [least, most] = TickLimits(joint);
  const bool one_turn = least >= 0 && most <= kOneTurn;
  absl::Status set =
      SetRegister(id, kOperatingMode, one_turn ? kPositionMode : kExtendedPositionMode, torque);
  // Beyond one turn the servo knows no limits; WriteGoals keeps ours.
  if (set.ok() && one_turn) set = SetRegister(id, kMaxPosition, most, torque);
  if (set.ok() && one_turn) set = SetRegister(id, kMinPosition, least, torque);
  const double turns_s2 = mount_.of(static_cast<MountJoint>(joint)).max_acceleration_rad_s2 *
                          TicksPerRadian(joint) / kTicksPerTurn;
  const auto acceleration =
      std::clamp<std::int64_t>(std::llround(turns_s2 / kAccelerationUnit_turn_s2), 1, 32767);
  if (set.ok()) set = bus_.Write(id, kProfileAcceleration, acceleration);
  const double turns_s = kGentle_rad_s * TicksPerRadian(joint) / kTicksPerTurn;
  if (set.ok()) {
    set = bus_.Write(id, kProfileVelocity,
                     std::max<std::int64_t>(1, std::llround(turns_s / kVelocityUnit_turn_s)));
  }
  return set;
}

absl::Status Head::BringUpJoint(int joint) {
  const int id = options_.servos[static_cast<std::size_t>(joint)].id;
  if (const absl::Status found = bus_.Ping(id); !found.ok()) {
    return absl::IsUnavailable(found) ? found : absl::NotFoundError(SilenceText(joint));
  }
  // Otherwise writes are not answered, the one to this register included.
  absl::StatusOr<std::int64_t> now = bus_.Read(id, kStatusReturnLevel);
  if (now.ok() && *now != 2) bus_.Write(id, kStatusReturnLevel, 2).IgnoreError();
  if (now.ok()) now = bus_.Read(id, kHardwareError);
  if (!now.ok()) return now.status();
  if (*now != 0) return absl::OkStatus();  // limp; Check() says why
  now = bus_.Read(id, kTorqueEnable);
  if (!now.ok()) return now.status();
  bool torque = *now != 0;
  if (absl::Status set = SetUp(joint, torque); !set.ok()) return set;
  now = bus_.Read(id, kPresentPosition);
  if (!now.ok()) return now.status();
  const auto [least, most] = TickLimits(joint);
  absl::Status held = bus_.Write(id, kGoalPosition, std::clamp(*now, least, most));
  if (held.ok() && !torque) held = bus_.Write(id, kTorqueEnable, 1);
  return held;
}

absl::Status Head::BringUp() {
  for (const int joint : joints_) {
    const absl::Status up = BringUpJoint(joint);
    if (absl::IsDeadlineExceeded(up)) return absl::NotFoundError(SilenceText(joint));
    if (absl::IsFailedPrecondition(up)) {
      return absl::FailedPreconditionError(
          absl::StrCat(ToString(static_cast<MountJoint>(joint)), ": ", up.message(),
                       "; is it a servo of the Dynamixel X series?"));
    }
    if (!up.ok()) return up;
  }
  return absl::OkStatus();
}

absl::Status Head::WriteGoals(const Eigen::Vector3d& angles_rad,
                              const Eigen::Vector3d& rates_rad_s) {
  Bytes parameters;
  for (const int joint : joints_) {
    const JointOptions& limits = mount_.of(static_cast<MountJoint>(joint));
    const auto [least, most] = TickLimits(joint);
    const double turns_s =
        std::min(rates_rad_s(joint), limits.max_rate_rad_s) * TicksPerRadian(joint) / kTicksPerTurn;
    // 0 would mean as fast as it can.
    const auto velocity =
        std::clamp<std::int64_t>(std::llround(turns_s / kVelocityUnit_turn_s), 1, 32767);
    Append(parameters, options_.servos[static_cast<std::size_t>(joint)].id, 1);
    Append(parameters, velocity, kProfileVelocity.size);
    Append(parameters, std::clamp(ToTicks(joint, angles_rad(joint)), least, most),
           kGoalPosition.size);
  }
  return bus_.SyncWrite(kProfileVelocity.address, kGoalSize, parameters);
}

absl::StatusOr<Head::Joints> Head::Read() {
  const absl::StatusOr<Bus::SyncAnswer> read =
      bus_.SyncRead(kPresentCurrent.address, kPresentSize, ids_);
  if (!read.ok()) return read.status();
  Joints result;
  result.time_ns = read->time_ns;
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    const int joint = joints_[k];
    const auto answer = std::find_if(read->answers.begin(), read->answers.end(),
                                     [&](const Answer& one) { return one.id == ids_[k]; });
    if (answer == read->answers.end()) {
      result.silent.push_back(joint);
      continue;
    }
    ++result.answered;
    result.alert |= answer->alert;
    const double turns_s =
        static_cast<double>(SignedAt(answer->parameters, 2, 4)) * kVelocityUnit_turn_s;
    result.currents_a(joint) =
        static_cast<double>(SignedAt(answer->parameters, 0, 2)) * kCurrentUnit_a;
    result.rates_rad_s(joint) = mount_.of(static_cast<MountJoint>(joint)).encoder_sign * turns_s *
                                kTicksPerTurn / TicksPerRadian(joint);
    result.angles_rad(joint) = ToAngle(joint, SignedAt(answer->parameters, 6, 4));
  }
  result.complete = result.silent.empty();
  return result;
}

absl::StatusOr<std::string> Head::Check() {
  const absl::StatusOr<Bus::SyncAnswer> read =
      bus_.SyncRead(kTorqueEnable.address, kStateSize, ids_);
  if (!read.ok()) return read.status();
  std::string problem;
  for (const Answer& answer : read->answers) {
    const auto k = std::find(ids_.begin(), ids_.end(), answer.id) - ids_.begin();
    const int joint = joints_[static_cast<std::size_t>(k)];
    const std::int64_t error = answer.parameters.back();
    if (error != 0) {
      absl::StrAppend(&problem, problem.empty() ? "" : "; ", Name(joint), ": ",
                      HardwareText(error));
    } else if (answer.parameters.front() == 0) {
      const absl::Status up = BringUpJoint(joint);
      if (absl::IsUnavailable(up)) return up;
      if (!up.ok()) absl::StrAppend(&problem, problem.empty() ? "" : "; ", up.message());
    }
  }
  return problem;
}

absl::Status Head::Release() {
  absl::Status all;
  for (const int id : ids_) all.Update(bus_.Write(id, kTorqueEnable, 0));
  return all;
}

}  // namespace saccade::dynamixel
