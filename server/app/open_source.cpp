#include "server/app/open_source.hpp"

#include "server/capture/source.hpp"
#include "server/mount/drivers/drivers.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {

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
