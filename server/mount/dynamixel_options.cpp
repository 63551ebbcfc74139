#include "server/mount/dynamixel_options.hpp"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <set>

#include "server/mount/mount_options.hpp"
#include "server/mount/toml_table.hpp"

namespace saccade {
namespace {

constexpr int kLeastBaud = 9600, kMostBaud = 4'500'000;
constexpr int kMostId = 252;

absl::Status Bad(const std::string& field, const std::string& value, const std::string& remedy) {
  return absl::InvalidArgumentError(absl::StrCat("dynamixel.", field, ": ", value, "; ", remedy));
}

absl::Status InRange(const std::string& field, double value, double least, double most) {
  if (value >= least && value <= most) return absl::OkStatus();
  return Bad(field, absl::StrCat(value), absl::StrCat("give a number from ", least, " to ", most));
}

void ReadServo(TomlTable& table, DynamixelServo& servo) {
  table.Integer("id", servo.id);
  table.Number("ticks_per_turn", 1.0, servo.ticks_per_turn);
  table.Integer("centre_tick", servo.centre_tick);
  table.Finish().IgnoreError();  // kept by the file
}

void ReadDynamixel(TomlTable& table, DynamixelOptions& options) {
  table.Integer("baud", options.baud);
  table.Number("update_hz", 1.0, options.update_hz);
  table.Number("answer_timeout_ms", 1e-3, options.answer_timeout_s);
  table.Number("silent_ms", 1e-3, options.silent_s);
  table.Number("retry_ms", 1e-3, options.retry_s);
  table.Number("max_retry_ms", 1e-3, options.max_retry_s);
  table.Boolean("release_at_end", options.release_at_end);
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    if (auto servo = table.Table(ToString(static_cast<MountJoint>(k)))) {
      ReadServo(*servo, options.servos[k]);
    }
  }
}

}  // namespace

absl::Status DynamixelOptions::Validate() const {
  std::set<int> ids;
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    const std::string name = ToString(static_cast<MountJoint>(k));
    const DynamixelServo& servo = servos[k];
    if (servo.id < -1 || servo.id > kMostId || (servo.id >= 0 && !ids.insert(servo.id).second)) {
      return Bad(name + ".id", absl::StrCat(servo.id),
                 absl::StrCat("give each servo its own number from 0 to ", kMostId,
                              ", or -1 for a joint without a motor"));
    }
    for (const absl::Status& status :
         {InRange(name + ".ticks_per_turn", servo.ticks_per_turn, 100, 1e7),
          InRange(name + ".centre_tick", servo.centre_tick, -1'000'000, 1'000'000)}) {
      if (!status.ok()) return status;
    }
  }
  if (ids.empty()) return Bad("pan.id", "-1", "at least one joint needs a motor");
  for (const absl::Status& status :
       {InRange("baud", baud, kLeastBaud, kMostBaud), InRange("update_hz", update_hz, 5, 1000),
        InRange("answer_timeout_ms", 1e3 * answer_timeout_s, 1, 1000),
        InRange("silent_ms", 1e3 * silent_s, 50, 10'000),
        InRange("retry_ms", 1e3 * retry_s, 5, 60'000),
        InRange("max_retry_ms", 1e3 * max_retry_s, 1e3 * retry_s, 60'000)}) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status DynamixelOptions::LoadToml(const std::filesystem::path& file) {
  return LoadTomlTable(file, "dynamixel", ReadDynamixel, *this);
}

absl::Status DynamixelOptions::ReadUri(const std::string& rest) {
  const std::pair<std::string, std::string> parts = absl::StrSplit(rest, absl::MaxSplits('?', 1));
  if (parts.first.empty()) {
    return absl::InvalidArgumentError(
        "--mount: dynamixel: names no device; write for example dynamixel:/dev/ttyUSB0");
  }
  device = parts.first;
  if (rest.find('?') == std::string::npos) return absl::OkStatus();
  int given = 0;
  if (!absl::StartsWith(parts.second, "baud=") ||
      !absl::SimpleAtoi(parts.second.substr(5), &given)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--mount: dynamixel: '", parts.second,
                     "' is not understood; write for example ?baud=1000000"));
  }
  baud = given;
  return Validate();
}

}  // namespace saccade
