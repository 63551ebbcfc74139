#include "server/mount/drivers/drivers.hpp"
#include "server/mount/drivers/dynamixel_mount.hpp"

namespace saccade {
namespace {

constexpr char kScheme[] = "dynamixel:";
constexpr char kExample[] = "dynamixel:/dev/ttyUSB0";

absl::Status CheckDynamixel(const std::string& rest, const MountFacts& facts) {
  if (absl::Status device = NeedsADevice(rest, kScheme, kExample); !device.ok()) return device;
  return NeedsTheClock(facts);
}

absl::StatusOr<OpenedMount> OpenDynamixel(const std::string& rest, const MountOptions& model,
                                          const MountContext& context) {
  DynamixelOptions options;
  absl::Status read;
  if (!context.config_file.empty()) read = options.LoadToml(context.config_file);
  if (read.ok()) read = options.ReadUri(rest);
  if (!read.ok()) return read;
  absl::StatusOr<std::shared_ptr<DynamixelMount>> made = DynamixelMount::Create(options, model);
  if (!made.ok()) return made.status();
  return OpenedMount{*std::move(made), nullptr, std::nullopt};
}

}  // namespace

MountDriver DynamixelDriver() {
  return {.scheme = kScheme,
          .usage = "dynamixel:DEVICE[?baud=N]",
          .example = kExample,
          .table = "dynamixel",
          .describe = DynamixelOptions::Describe,
          .check = CheckDynamixel,
          .open = OpenDynamixel};
}

}  // namespace saccade
