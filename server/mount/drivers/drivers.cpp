#include "server/mount/drivers/drivers.hpp"

#include <absl/strings/str_cat.h>

namespace saccade {

MountRegistry MountDrivers() {
  MountRegistry registry;
  registry.Add(SimDriver());
  registry.Add(DynamixelDriver());
  registry.Add(V4l2Driver());
  registry.Add(CropDriver());
  return registry;
}

absl::Status NeedsTheClock(const MountFacts& facts) {
  if (!facts.every_frame) return absl::OkStatus();
  return absl::InvalidArgumentError("--mount: a head moves by the clock: leave --speed max out");
}

absl::Status NeedsADevice(const std::string& rest, const std::string& scheme,
                          const std::string& example) {
  if (!rest.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--mount: ", scheme, " names no device: write for example ", example));
}

}  // namespace saccade
