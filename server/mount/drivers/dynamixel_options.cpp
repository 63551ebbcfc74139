#include "server/mount/drivers/dynamixel_options.hpp"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <set>

#include "server/mount/mount_options.hpp"
#include "shared/io/option_table.hpp"
#include "shared/io/toml_table.hpp"

namespace saccade {
namespace {

constexpr int kMostId = 252;

const OptionTable<DynamixelServo>& ServoTable() {
  using O = DynamixelServo;
  static const OptionTable<O> table = {
      {"id", &O::id, -1, kMostId, "each its own; -1: no motor, the joint stays at 0"},
      {"ticks_per_turn", &O::ticks_per_turn, 100, 1e7, "of the joint: times the ratio of a gear"},
      {"centre_tick", &O::centre_tick, -1'000'000, 1'000'000, "where its raw angle is 0"},
  };
  return table;
}

const OptionTable<DynamixelOptions>& Table() {
  using O = DynamixelOptions;
  static const OptionTable<O> table = {
      {"baud", &O::baud, 9600, 4'500'000, "the URI wins; 100 Hz needs about 1000000"},
      {"update_hz", &O::update_hz, 5, 1000, "goals and readings a second"},
      {"answer_timeout_ms", &O::answer_timeout_s, 1, 1000, "beyond the time on the wire", 1e-3},
      {"silent_ms", &O::silent_s, 50, 10'000, "without answers: at fault, or disconnected", 1e-3},
      {"retry_ms", &O::retry_s, 5, 60'000, "between attempts to connect, doubled up to", 1e-3},
      {"max_retry_ms", &O::max_retry_s, 5, 60'000, "that", 1e-3},
      {"release_at_end", &O::release_at_end, 0, 1, "torque off at the end: the head may drop"},
  };
  return table;
}

absl::Status Bad(const std::string& field, const std::string& value, const std::string& remedy) {
  return absl::InvalidArgumentError(absl::StrCat("dynamixel.", field, ": ", value, "; ", remedy));
}

void ReadDynamixel(TomlTable& table, DynamixelOptions& options) {
  Table().Read(table, options);
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    if (auto servo = table.Table(ToString(static_cast<MountJoint>(k)))) {
      ServoTable().Read(*servo, options.servos[k]);
      servo->Finish().IgnoreError();  // kept by the file
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
    const std::string prefix = absl::StrCat("dynamixel.", name, ".");
    if (absl::Status valid = ServoTable().Validate(servo, prefix); !valid.ok()) return valid;
  }
  if (ids.empty()) return Bad("pan.id", "-1", "at least one joint needs a motor");
  if (absl::Status valid = Table().Validate(*this, "dynamixel."); !valid.ok()) return valid;
  return CheckRange("dynamixel.max_retry_ms", 1e3 * max_retry_s, 1e3 * retry_s, 60'000);
}

std::string DynamixelOptions::Describe() {
  const DynamixelOptions defaults;
  std::string text = absl::StrCat("[dynamixel]\n", Table().Describe(defaults));
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    absl::StrAppend(&text, "[dynamixel.", ToString(static_cast<MountJoint>(k)), "]\n",
                    ServoTable().Describe(defaults.servos[k]));
  }
  return text;
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
