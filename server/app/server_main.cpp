// saccade-server: configuration, wiring, shutdown.
#include <absl/status/status.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "server/app/engine.hpp"
#include "server/app/open_source.hpp"
#include "server/app/server_config.hpp"
#include "server/app/slam_tracker.hpp"
#include "server/gateway/gateway.hpp"
#include "server/pipeline/descriptors.hpp"
#include "server/rpc/rpc_server.hpp"
#include "server/rpc/stream_hub.hpp"
#include "server/store/annotation_store.hpp"

namespace saccade {
namespace {

// Blocked in every thread, so that only WaitForEnd hears them.
sigset_t BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  return signals;
}

void WaitForEnd(const sigset_t& signals, const std::optional<double>& run_for_s) {
  if (!run_for_s) {
    int got = 0;
    sigwait(&signals, &got);
    return;
  }
  timespec rest{};
  rest.tv_sec = static_cast<time_t>(*run_for_s);
  rest.tv_nsec = static_cast<long>((*run_for_s - static_cast<double>(rest.tv_sec)) * 1e9);
  sigtimedwait(&signals, nullptr, &rest);
}

std::filesystem::path WebRoot(const ServerConfig& config) {
  if (!config.web_root.empty()) return config.web_root;
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path installed = program.parent_path().parent_path() / "share/saccade/web";
  if (!error && std::filesystem::exists(installed, error)) return installed;
  return SACCADE_WEB_ROOT;
}

absl::StatusOr<std::unique_ptr<Engine>> MakeEngine(const ServerConfig& config, StreamHub& hub) {
  absl::StatusOr<OpenedSource> opened = OpenConfiguredSource(config);
  if (!opened.ok()) return opened.status();
  SourceInfo info = opened->source->info();
  if (opened->mount && !opened->crop)
    info.mount = std::make_shared<const MountModel>(opened->mount->model());
  EngineOptions options;
  if (opened->crop) {  // nothing to wear out, and no blur: quick, unless the file says otherwise
    options.gaze.rate_deg_s = 120.0;
    options.gaze.acceleration_deg_s2 = 2000.0;
  }
  TrackerOptions tracker_options;
  tracker_options.seed = config.seed;
  tracker_options.adjust_live = true;
  if (!config.config_file.empty()) {
    const absl::Status loaded = tracker_options.LoadToml(config.config_file);
    if (!loaded.ok()) return loaded;
    if (absl::Status gaze = options.gaze.LoadToml(config.config_file); !gaze.ok()) return gaze;
  }
  absl::StatusOr<std::unique_ptr<FrameTracker>> tracker = MakeSlamTracker(info, tracker_options);
  if (!tracker.ok()) return tracker.status();
  absl::StatusOr<std::unique_ptr<AnnotationStore>> store = AnnotationStore::Open(config.data_dir);
  if (!store.ok()) return store.status();
  options.version = kVersion;
  options.mount = opened->mount;
  options.crop = opened->crop;
  options.every_frame = config.every_frame;
  options.video_bit_rate_bit_s = config.video_bit_rate_bit_s;
  return Engine::Create(std::move(options), std::move(opened->source), *std::move(tracker),
                        *std::move(store), hub);
}

void SayReady(const ServerConfig& config, int grpc_port, int http_port) {
  const nlohmann::ordered_json ready = {{"event", "ready"},
                                        {"grpc", config.grpc.ToString(grpc_port)},
                                        {"http", config.http.ToString(http_port)}};
  std::printf("%s\n", ready.dump().c_str());
  std::fflush(stdout);
}

// One line, also where a library's own words have several.
void SayProblem(const absl::Status& problem) {
  std::string line(problem.message());
  std::replace(line.begin(), line.end(), '\n', ' ');
  line.erase(
      std::unique(line.begin(), line.end(), [](char a, char b) { return a == ' ' && b == ' '; }),
      line.end());
  std::fprintf(stderr, "saccade-server: %s\n", line.c_str());
}

absl::Status Serve(const ServerConfig& config) {
  const sigset_t signals = BlockSignals();
  RaiseDescriptorLimit();
  StreamHub hub;
  absl::StatusOr<std::unique_ptr<Engine>> engine = MakeEngine(config, hub);
  if (!engine.ok()) return engine.status();
  hub.Connect(engine->get());
  RpcServerOptions rpc_options;
  rpc_options.host = config.grpc.host;
  rpc_options.port = config.grpc.port;
  rpc_options.limits = RpcLimits().Scaled(config.limits_scale);
  absl::StatusOr<std::unique_ptr<RpcServer>> rpc = RpcServer::Start(rpc_options, **engine, hub);
  if (!rpc.ok()) return rpc.status();
  GatewayOptions gateway_options;
  gateway_options.host = config.http.host;
  gateway_options.port = config.http.port;
  gateway_options.web_root = WebRoot(config);
  absl::StatusOr<std::unique_ptr<Gateway>> gateway =
      Gateway::Start(gateway_options, (*rpc)->InProcessChannel());
  if (!gateway.ok()) return gateway.status();
  (*engine)->Start();
  SayReady(config, (*rpc)->port(), (*gateway)->port());
  WaitForEnd(signals, config.run_for_s);
  // Streams end first, then browsers, then the threads that answer commands, then calls.
  hub.CloseAll(absl::UnavailableError("the server is shutting down"));
  (*gateway)->Stop();
  (*engine)->Stop();
  (*rpc)->Stop(std::chrono::milliseconds(500));
  return absl::OkStatus();
}

}  // namespace
}  // namespace saccade

int main(int argc, char** argv) {
  // gRPC's own words for what is said below in one line; whoever wants them sets the variable.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  const auto config = saccade::ServerConfig::FromCommandLine(argc, argv);
  if (!config.ok()) {
    saccade::SayProblem(config.status());
    return 2;
  }
  if (!config->has_value()) return 0;
  const absl::Status served = saccade::Serve(**config);
  if (served.ok()) return 0;
  saccade::SayProblem(served);
  return 1;
}
