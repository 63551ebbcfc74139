#include "server/app/open_source.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cstdint>

#include "server/capture/source.hpp"
#include "server/mount/drivers/drivers.hpp"
#include "server/sim/sim_source.hpp"
#include "shared/io/log.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLongestName = 80;

/// Fowler, Noll and Vo's hash, the same on every machine.
std::uint32_t Fnv1a(absl::string_view text) {
  std::uint32_t hash = 2166136261U;
  for (const char each : text) hash = (hash ^ static_cast<unsigned char>(each)) * 16777619U;
  return hash;
}

}  // namespace

std::filesystem::path KeptCameraFile(const ServerConfig& config) {
  if (config.data_dir.empty() || absl::StartsWith(config.source, "phone:")) return {};
  // Sources that differ in one character only do not meet in one file.
  std::string name;
  for (const char each : config.source) name += absl::ascii_isalnum(each) ? each : '-';
  if (name.size() > kLongestName) name.resize(kLongestName);
  return config.data_dir / "cameras" / absl::StrFormat("%s-%08x.yaml", name, Fnv1a(config.source));
}

absl::StatusOr<OpenedSource> OpenConfiguredSource(const ServerConfig& config) {
  SimSource* sim = nullptr;
  SourceRegistry sources = CaptureSources();
  sources.Add("sim",
              [&](absl::string_view rest,
                  const SourceOptions& options) -> absl::StatusOr<std::unique_ptr<FrameSource>> {
                absl::StatusOr<std::unique_ptr<SimSource>> source =
                    SimSource::OpenUri(rest, options, config.gl);
                if (!source.ok()) return source.status();
                sim = source->get();
                return *std::move(source);
              });
  PhoneSource* phone = nullptr;
  sources.Add("phone",
              [&](absl::string_view rest,
                  const SourceOptions& options) -> absl::StatusOr<std::unique_ptr<FrameSource>> {
                absl::StatusOr<std::unique_ptr<PhoneSource>> source =
                    PhoneSource::Open(rest, options);
                if (!source.ok()) return source.status();
                phone = source->get();
                return *std::move(source);
              });
  SourceOptions options;
  options.realtime = !config.every_frame;
  options.camera_file = config.camera_file;
  const std::filesystem::path kept = KeptCameraFile(config);
  if (options.camera_file.empty() && !kept.empty() && MayExist(kept)) {
    options.camera_file = kept;
    Log(absl::StrCat("camera ", kept.string(),
                     " is used, which a calibration made; remove it to go without, or give another "
                     "with --camera"));
  }
  absl::StatusOr<std::unique_ptr<FrameSource>> source = sources.Open(config.source, options);
  if (!source.ok()) return source.status();
  absl::StatusOr<OpenedMount> mount = MountDrivers().Open(
      config.mount, {config.config_file, config.seed, (*source)->info().camera->intrinsics()});
  if (!mount.ok()) return mount.status();
  // A simulated head goes with a sim: source alone; its driver's check says so.
  if (sim != nullptr && mount->head) sim->DriveHead(mount->head);
  if (sim != nullptr && !config.sim_truth.empty()) {
    if (absl::Status truth = sim->WriteTruthTo(config.sim_truth); !truth.ok()) return truth;
  }
  return OpenedSource{*std::move(source), *std::move(mount), phone};
}

}  // namespace saccade
