#include "server/app/open_source.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include "server/capture/source.hpp"
#include "server/mount/crop_mount.hpp"
#include "server/mount/dynamixel_mount.hpp"
#include "server/mount/sim_mount.hpp"
#include "server/mount/v4l2_mount.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {
namespace {

/// From the file, if there is one.
template <typename Options>
absl::Status Load(const ServerConfig& config, Options& options) {
  return config.config_file.empty() ? absl::OkStatus() : options.LoadToml(config.config_file);
}

absl::StatusOr<std::shared_ptr<SimMount>> OpenSimMount(const ServerConfig& config) {
  SimMountOptions options;
  options.wall_clock = true;
  options.seed = config.seed;
  if (absl::Status loaded = Load(config, options.mount); !loaded.ok()) return loaded;
  const std::pair<std::string, std::string> parts =
      absl::StrSplit(config.mount, absl::MaxSplits('?', 1));
  if (!parts.second.empty()) {
    absl::string_view rest = parts.second;
    std::uint64_t seed = 0;
    if (!absl::ConsumePrefix(&rest, "crooked=") || !absl::SimpleAtoi(rest, &seed)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "--mount: sim?", parts.second, " is not understood; write for example sim?crooked=1"));
    }
    options.truth = CrookedMount(seed);
  }
  return std::make_shared<SimMount>(options);
}

/// A head of motors, by what the URI names; null: none of these.
absl::StatusOr<std::shared_ptr<Mount>> OpenRealMount(const ServerConfig& config) {
  const auto [scheme, rest] =
      std::pair<std::string, std::string>(absl::StrSplit(config.mount, absl::MaxSplits(':', 1)));
  MountOptions mount;
  if (absl::Status loaded = Load(config, mount); !loaded.ok()) return loaded;
  if (scheme == "dynamixel") {
    DynamixelOptions options;
    absl::Status read = Load(config, options);
    if (read.ok()) read = options.ReadUri(rest);
    if (!read.ok()) return read;
    return DynamixelMount::Create(options, mount);
  }
  if (scheme == "v4l2") {
    V4l2Options options;
    options.device = rest;
    if (absl::Status read = Load(config, options); !read.ok()) return read;
    return V4l2Mount::Create(options, mount);
  }
  return nullptr;
}

/// "WxH", or nothing: half of the picture.
absl::StatusOr<std::shared_ptr<CropMount>> OpenCrop(const std::string& size,
                                                    const CameraIntrinsics& camera) {
  int width = camera.width / 4 * 2, height = camera.height / 4 * 2;
  const std::pair<std::string, std::string> parts = absl::StrSplit(size, absl::MaxSplits('x', 1));
  if (!size.empty() &&
      !(absl::SimpleAtoi(parts.first, &width) && absl::SimpleAtoi(parts.second, &height))) {
    return absl::InvalidArgumentError(
        absl::StrCat("--mount: crop:", size, " is not crop:WxH, for example crop:480x360"));
  }
  return CropMount::Create(camera, width, height);
}

absl::StatusOr<std::unique_ptr<FrameSource>> OpenSim(const ServerConfig& config,
                                                     absl::string_view rest,
                                                     const SourceOptions& options,
                                                     const std::shared_ptr<SimMount>& head) {
  absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::OpenUri(rest, options, config.gl);
  if (!source.ok()) return source.status();
  if (head) (*source)->DriveHead(head);
  if (!config.sim_truth.empty()) {
    if (absl::Status truth = (*source)->WriteTruthTo(config.sim_truth); !truth.ok()) return truth;
  }
  return std::unique_ptr<FrameSource>(*std::move(source));
}

}  // namespace

absl::StatusOr<OpenedSource> OpenConfiguredSource(const ServerConfig& config) {
  std::shared_ptr<SimMount> head;
  if (config.mount == "sim" || config.mount.rfind("sim?", 0) == 0) {
    absl::StatusOr<std::shared_ptr<SimMount>> made = OpenSimMount(config);
    if (!made.ok()) return made.status();
    head = *std::move(made);
  }
  SourceRegistry sources = CaptureSources();
  sources.Add("sim", [&](absl::string_view rest, const SourceOptions& options) {
    return OpenSim(config, rest, options, head);
  });
  SourceOptions options;
  options.realtime = !config.every_frame;
  options.camera_file = config.camera_file;
  absl::StatusOr<std::unique_ptr<FrameSource>> source = sources.Open(config.source, options);
  if (!source.ok()) return source.status();
  OpenedSource opened{*std::move(source), head, std::nullopt};
  if (head == nullptr) {
    absl::StatusOr<std::shared_ptr<Mount>> real = OpenRealMount(config);
    if (!real.ok()) return real.status();
    opened.mount = *std::move(real);
  }
  if (config.mount.rfind("crop:", 0) == 0) {
    absl::StatusOr<std::shared_ptr<CropMount>> crop =
        OpenCrop(config.mount.substr(5), opened.source->info().camera->intrinsics());
    if (!crop.ok()) return crop.status();
    opened.crop = (*crop)->view();
    opened.mount = *std::move(crop);
  }
  return opened;
}

}  // namespace saccade
