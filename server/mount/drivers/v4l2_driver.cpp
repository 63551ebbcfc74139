#include "server/mount/drivers/drivers.hpp"
#include "server/mount/drivers/v4l2_mount.hpp"

namespace saccade {
namespace {

constexpr char kScheme[] = "v4l2:";
constexpr char kExample[] = "v4l2:/dev/video0";

absl::Status CheckV4l2(const std::string& rest, const MountFacts& facts) {
  if (absl::Status device = NeedsADevice(rest, kScheme, kExample); !device.ok()) return device;
  return NeedsTheClock(facts);
}

absl::StatusOr<OpenedMount> OpenV4l2(const std::string& rest, const MountOptions& model,
                                     const MountContext& context) {
  V4l2Options options;
  options.device = rest;
  if (!context.config_file.empty()) {
    if (absl::Status read = options.LoadToml(context.config_file); !read.ok()) return read;
  }
  absl::StatusOr<std::shared_ptr<V4l2Mount>> made = V4l2Mount::Create(options, model);
  if (!made.ok()) return made.status();
  return OpenedMount{*std::move(made), nullptr, std::nullopt};
}

}  // namespace

MountDriver V4l2Driver() {
  return {.scheme = kScheme,
          .usage = "v4l2:DEVICE",
          .example = kExample,
          .table = "v4l2",
          .describe = V4l2Options::Describe,
          .check = CheckV4l2,
          .open = OpenV4l2};
}

}  // namespace saccade
