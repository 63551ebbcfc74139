#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include "server/mount/drivers/crop_mount.hpp"
#include "server/mount/drivers/drivers.hpp"

namespace saccade {
namespace {

/// `size` is "WxH", or nothing: half of the picture.
absl::StatusOr<OpenedMount> OpenCrop(const std::string& size, const MountOptions& /*model*/,
                                     const MountContext& context) {
  int width = context.camera.width / 4 * 2, height = context.camera.height / 4 * 2;
  const std::pair<std::string, std::string> parts = absl::StrSplit(size, absl::MaxSplits('x', 1));
  if (!size.empty() &&
      !(absl::SimpleAtoi(parts.first, &width) && absl::SimpleAtoi(parts.second, &height))) {
    return absl::InvalidArgumentError(
        absl::StrCat("--mount: crop:", size, " is not crop:WxH, for example crop:480x360"));
  }
  absl::StatusOr<std::shared_ptr<CropMount>> made =
      CropMount::Create(context.camera, width, height);
  if (!made.ok()) return made.status();
  return OpenedMount{*made, nullptr, (*made)->view()};
}

}  // namespace

MountDriver CropDriver() {
  return {.scheme = "crop:",
          .usage = "crop:[WxH]",
          .example = "crop:",
          .table = "",
          .describe = nullptr,
          .check = [](const std::string&, const MountFacts&) { return absl::OkStatus(); },
          .open = OpenCrop};
}

}  // namespace saccade
