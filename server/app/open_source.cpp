#include "server/app/open_source.hpp"

#include "server/capture/source.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {
namespace {

absl::StatusOr<std::unique_ptr<FrameSource>> OpenSim(const ServerConfig& config,
                                                     absl::string_view rest,
                                                     const SourceOptions& options) {
  absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::OpenUri(rest, options, config.gl);
  if (!source.ok()) return source.status();
  if (!config.sim_truth.empty()) {
    if (absl::Status truth = (*source)->WriteTruthTo(config.sim_truth); !truth.ok()) return truth;
  }
  return std::unique_ptr<FrameSource>(*std::move(source));
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrameSource>> OpenConfiguredSource(const ServerConfig& config) {
  SourceRegistry sources = CaptureSources();
  sources.Add("sim", [&config](absl::string_view rest, const SourceOptions& options) {
    return OpenSim(config, rest, options);
  });
  SourceOptions options;
  options.realtime = !config.every_frame;
  options.camera_file = config.camera_file;
  return sources.Open(config.source, options);
}

}  // namespace saccade
