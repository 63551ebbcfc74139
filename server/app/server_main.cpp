// saccade-server: configuration, wiring, shutdown.
#include <absl/cleanup/cleanup.h>
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <nlohmann/json.hpp>

#include "server/app/apply_limits.hpp"
#include "server/app/engine.hpp"
#include "server/app/front_door.hpp"
#include "server/app/make_team.hpp"
#include "server/app/map_keeper.hpp"
#include "server/app/memory.hpp"
#include "server/app/open_source.hpp"
#include "server/app/replay_backend.hpp"
#include "server/app/server_config.hpp"
#include "server/app/shutdown.hpp"
#include "server/app/view_encoder.hpp"
#include "server/audio/wearer_voice.hpp"
#include "server/calibrate/calibration_desk.hpp"
#include "server/gateway/gateway.hpp"
#include "server/pipeline/descriptors.hpp"
#include "server/record/recorder.hpp"
#include "server/rpc/rpc_server.hpp"
#include "server/rpc/stream_hub.hpp"
#include "server/store/annotation_store.hpp"
#include "server/tracker/make_tracker.hpp"
#include "server/wear/wearer_entrance.hpp"
#include "shared/io/log.hpp"
#include "shared/io/regular_file.hpp"
#include "shared/version/version.hpp"

namespace saccade {
namespace {

std::filesystem::path WebRoot(const ServerConfig& config) {
  if (!config.web_root.empty()) return config.web_root;
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path installed = program.parent_path().parent_path() / "share/saccade/web";
  if (!error && std::filesystem::exists(installed, error)) return installed;
  return SACCADE_WEB_ROOT;
}

/// Whether pictures of this camera can be coded as asked for: else there would be no video, and
/// nobody would know before they look.
absl::Status CheckVideo(const ServerConfig& config, const OpenedSource& opened) {
  const CameraIntrinsics& camera = opened.source->info().camera->intrinsics();
  for (const CameraIntrinsics& view : {camera, opened.mount.crop.value_or(camera)}) {
    const auto encoder = VideoEncoder::Create(
        VideoOptions(view.width, view.height, camera.fps, config.video_bit_rate_bit_s));
    if (encoder.ok()) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        opened.source->info().uri, ": there would be no video: ", encoder.status().message(),
        "; give smaller pictures, or leave "
        "video.bit_rate_bit_s out"));
  }
  return absl::OkStatus();
}

/// Without the password that an address may hold.
std::string NameForReports(const std::string& source) {
  return source.find('@') == std::string::npos ? source : source.substr(0, source.find(':'));
}

/// The last map, or the one asked for. That the last one cannot be used is no reason not to start.
absl::Status ResumeFirst(const ServerConfig& config, MapKeeper& maps, Engine& engine) {
  const bool asked = config.map != "last";
  const auto stored = maps.ReadFirst(asked ? config.map : "");
  absl::Status status = stored.status();
  if (status.ok() && stored->has_value()) status = engine.Resume(**stored);
  if (status.ok()) {
    if (stored->has_value()) Log(absl::StrCat("map ", (*stored)->world, " is looked for"));
    return status;
  }
  if (asked) {
    return absl::Status(status.code(), absl::StrCat("--map ", config.map, ": ", status.message()));
  }
  Log(absl::StrCat("the last map is set aside: ", status.message()));
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<Engine>> MakeEngine(const ServerConfig& config, EventSink& sink,
                                                   PhoneSource*& phone,
                                                   std::shared_ptr<CalibrationDesk>& calibration,
                                                   Shutdown& shutdown) {
  shutdown.SetPhase("opening the source");
  absl::StatusOr<OpenedSource> opened = OpenConfiguredSource(config);
  if (!opened.ok()) return opened.status();
  if (absl::Status video = CheckVideo(config, *opened); !video.ok()) return video;
  phone = opened->phone;
  SourceInfo info = opened->source->info();
  if (opened->mount.mount && !opened->mount.crop)
    info.mount = std::make_shared<const MountModel>(opened->mount.mount->model());
  EngineOptions options;
  if (opened->mount
          .crop) {  // nothing to wear out, and no blur: quick, unless the file says otherwise
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
  LandmarkOptions landmarks;
  landmarks.live = true;
  if (!config.config_file.empty()) {
    if (absl::Status read = landmarks.LoadToml(config.config_file); !read.ok()) return read;
  }
  absl::StatusOr<std::unique_ptr<FrameTracker>> tracker =
      MakeFrameTracker(info, tracker_options, landmarks);
  if (!tracker.ok()) return tracker.status();
  shutdown.SetPhase("opening the data base");
  absl::StatusOr<std::unique_ptr<AnnotationStore>> store = AnnotationStore::Open(config.data_dir);
  if (!store.ok()) return store.status();
  absl::StatusOr<std::unique_ptr<PictureSwitch>> pictures = PictureSwitch::Open(config.data_dir);
  if (!pictures.ok()) return pictures.status();
  options.pictures = *std::move(pictures);
  absl::StatusOr<std::unique_ptr<SceneKeeper>> scene = SceneKeeper::Open(config.data_dir);
  if (!scene.ok()) return scene.status();
  options.scene = *std::move(scene);
  calibration = std::make_shared<CalibrationDesk>(CalibrationDesk::Options{
      NameForReports(config.source), KeptCameraFile(config),
      [pictures = options.pictures](FrameId id) { return pictures->MayShow(id).ok(); }});
  options.calibration = calibration;
  options.gl = config.gl;
  options.overlay.features = config.overlay_dots;
  options.overlay.world_axes = config.overlay_axes;
  options.overlay.status_line = config.overlay_status;
  options.version = Version();
  ApplyLimits(config, options.anchors);
  options.mount = opened->mount.mount;
  options.crop = opened->mount.crop;
  if (config.surface_cores > 0.0) {
    auto surfaces = SurfaceRunner::Create({.surface = {}, .most_cores = config.surface_cores});
    if (!surfaces.ok()) return surfaces.status();
    options.surfaces = *std::move(surfaces);
  }
  std::shared_ptr<MapKeeper> maps;
  if (config.map != "none") {
    maps = std::make_shared<MapKeeper>(MapKeeperOptions{.directory = config.data_dir / "maps"});
  }
  options.maps = maps;
  options.every_frame = config.every_frame;
  options.video_bit_rate_bit_s = config.video_bit_rate_bit_s;
  auto engine = Engine::Create(std::move(options), std::move(opened->source), *std::move(tracker),
                               *std::move(store), sink);
  if (!engine.ok() || !maps || config.map == "new") return engine;
  if (absl::Status resumed = ResumeFirst(config, *maps, **engine); !resumed.ok()) return resumed;
  return engine;
}

void SayReady(const ServerConfig& config, int grpc_port, int http_port) {
  const nlohmann::ordered_json ready = {{"event", "ready"},
                                        {"grpc", config.grpc.ToString(grpc_port)},
                                        {"http", config.http.ToString(http_port)},
                                        {"tls", config.WantsTls(config.http)}};
  Announce(ready.dump());
}

constexpr std::size_t kMaxPemBytes = 256 * 1024;

absl::Status InvalidCa(absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("tls.client_ca: ", why));
}

absl::Status LetIn(FrontDoor& door, const ServerConfig& config, RpcServerOptions& options) {
  options.access = &door.access();
  options.provider = door.provider();
  options.insecure = door.insecure();
  options.make_link = [&door](AccessRole role, const std::string& token) {
    return door.LinkOf(role, token);
  };
  if (const std::optional<ServerIdentity> tls = door.TlsOf(config.grpc)) {
    options.tls = TlsPair{tls->chain_pem, tls->key_pem};
  }
  options.machines = config.client_roles;
  if (config.client_ca.empty()) return absl::OkStatus();
  absl::StatusOr<std::string> pem =
      ReadRegularFile(config.client_ca, kMaxPemBytes, "a certificate");
  if (!pem.ok()) return InvalidCa(pem.status().message());
  if (!InspectCertificate(*pem).ok()) return InvalidCa("holds no certificate (PEM)");
  options.client_ca_pem = *std::move(pem);
  return absl::OkStatus();
}

absl::Status Renew(const ServerIdentity& renewed, const ServerConfig& config, RpcServer& rpc,
                   Gateway& gateway) {
  absl::Status status;
  if (config.WantsTls(config.http)) {
    status =
        gateway.SetTls(renewed.chain_pem, renewed.key_pem, renewed.root_pem, renewed.root_sha256);
  }
  // Also where the other port could not.
  if (config.WantsTls(config.grpc)) {
    status.Update(rpc.SetTls({renewed.chain_pem, renewed.key_pem}));
  }
  return status;
}

// One line, also where a library's own words have several.
void SayProblem(const absl::Status& problem) {
  std::string line(problem.message());
  std::replace(line.begin(), line.end(), '\n', ' ');
  line.erase(
      std::unique(line.begin(), line.end(), [](char a, char b) { return a == ' ' && b == ' '; }),
      line.end());
  Log(absl::StrCat("saccade-server: ", line));
  FlushLog(std::chrono::milliseconds(500));
}

/// A recording in the engine's place.
struct Replay {
  static absl::StatusOr<std::unique_ptr<Replay>> Open(const std::string& file) {
    auto replayer = Replayer::Open(file);
    if (!replayer.ok()) return replayer.status();
    return std::unique_ptr<Replay>(new Replay(*std::move(replayer), file));
  }
  Replayer& replayer() { return *player; }

  const std::unique_ptr<Replayer> player;
  ReplayBackend backend;

 private:
  Replay(std::unique_ptr<Replayer> opened, const std::string& file)
      : player(std::move(opened)), backend(*player, Version(), absl::StrCat("replay:", file)) {}
};

absl::Status Serve(const ServerConfig& config, Shutdown& shutdown) {
  RaiseDescriptorLimit();
  StreamHub hub;
  WearerTee tee(hub);
  PhoneSource* phone = nullptr;
  std::shared_ptr<CalibrationDesk> calibration;
  // One of the two: what happens, or what has happened.
  std::unique_ptr<Engine> engine;
  std::unique_ptr<Replay> replay;
  if (absl::string_view file = config.source; absl::ConsumePrefix(&file, "replay:")) {
    auto opened = Replay::Open(std::string(file));
    if (!opened.ok()) return opened.status();
    replay = *std::move(opened);
  } else {
    auto made = MakeEngine(config, tee, phone, calibration, shutdown);
    if (!made.ok()) return made.status();
    engine = *std::move(made);
  }
  Backend& backend = engine ? static_cast<Backend&>(*engine) : replay->backend;
  const absl::Cleanup no_commit = [&shutdown] { shutdown.SetCommit(nullptr); };
  if (engine) {
    shutdown.SetCommit(
        [&engine](std::chrono::milliseconds limit) { return engine->FlushStore(limit); });
  }
  hub.Connect(&backend);
  const std::unique_ptr<TeamRunner> team = engine ? MakeTeam(config, *engine) : nullptr;
  absl::StatusOr<std::optional<TeamLinkOptions>> to_other = LinkOf(config);
  if (!to_other.ok()) return to_other.status();
  RpcServerOptions rpc_options;
  rpc_options.host = config.grpc.host;
  rpc_options.port = config.grpc.port;
  rpc_options.calibration = calibration.get();
  rpc_options.team = team.get();
  constexpr std::uint64_t kMegabyte = std::uint64_t{1} << 20;
  Recorder recorder(
      hub, {.directory = config.record_dir,
            .file_bytes = static_cast<std::uint64_t>(config.record_file_mb) * kMegabyte,
            .file_length = std::chrono::seconds(config.record_file_s),
            .keep_free_bytes = static_cast<std::uint64_t>(config.record_keep_free_mb) * kMegabyte,
            .version = Version(),
            .source = NameForReports(config.source)});
  rpc_options.recording = &recorder;
  rpc_options.replay = replay ? &replay->replayer() : nullptr;
  ApplyLimits(config, rpc_options);
  shutdown.SetPhase("making certificates");
  const absl::StatusOr<std::unique_ptr<FrontDoor>> door = FrontDoor::Open(config);
  if (!door.ok()) return door.status();
  if (absl::Status let = LetIn(**door, config, rpc_options); !let.ok()) return let;
  shutdown.SetPhase("opening the ports");
  absl::StatusOr<std::unique_ptr<RpcServer>> rpc = RpcServer::Start(rpc_options, backend, hub);
  if (!rpc.ok()) return rpc.status();
  // Its kind: the whole may hold a password.
  const std::string other = config.source.substr(0, config.source.find(':'));
  WearerEntrance wearer((*door)->access(), phone, other);
  tee.Connect(&wearer);
  GatewayOptions gateway_options;
  gateway_options.wearer = &wearer;
  gateway_options.host = config.http.host;
  gateway_options.port = config.http.port;
  gateway_options.web_root = WebRoot(config);
  gateway_options.allowed_hosts = (*door)->allowed_hosts();
  // gRPC's own limit, and what base64 adds: more is nobody's, and is held before it is looked at.
  gateway_options.max_request_bytes = 1280 * 1024;
  if (const std::optional<ServerIdentity> tls = (*door)->TlsOf(config.http)) {
    gateway_options.tls_chain_pem = tls->chain_pem;
    gateway_options.tls_key_pem = tls->key_pem;
    gateway_options.root_pem = tls->root_pem;
    gateway_options.root_sha256 = tls->root_sha256;
  }
  ApplyLimits(config, **rpc, gateway_options);
  absl::StatusOr<std::unique_ptr<Gateway>> gateway =
      Gateway::Start(gateway_options, (*rpc)->InProcessChannel());
  if (!gateway.ok()) return gateway.status();
  const absl::Status announced = (*door)->Announce((*rpc)->port(), (*gateway)->port());
  if (!announced.ok()) return announced;
  (*door)->Watch(
      [&](const ServerIdentity& renewed) { return Renew(renewed, config, **rpc, **gateway); });
  const absl::Cleanup no_watch = [&door] { (*door)->Watch(nullptr); };
  std::unique_ptr<WearerVoice> voice;
  if (!config.audio_in.empty() || !config.audio_out.empty()) {
    shutdown.SetPhase("opening the audio devices");
    auto opened = WearerVoice::Start({.capture = config.audio_in,
                                      .playback = config.audio_out,
                                      .token = (*door)->access().owner_token()},
                                     (*rpc)->InProcessChannel());
    if (!opened.ok()) return opened.status();
    voice = *std::move(opened);
  }
  engine ? engine->Start() : replay->replayer().Start(tee);
  if (config.record) {
    recorder.StartRecording([](const absl::StatusOr<RecordingState>& started) {
      if (!started.ok()) Log(absl::StrCat("recording: ", started.status().message()));
    });
  }
  std::unique_ptr<TeamLink> link;
  if (team && *to_other) link = std::make_unique<TeamLink>(**std::move(to_other), *team);
  shutdown.SetPhase("a frame, a call or the disk to be done with");
  SayReady(config, (*rpc)->port(), (*gateway)->port());
  shutdown.Wait(config.run_for_s);
  voice.reset();
  link.reset();
  if (team) team->Stop();
  recorder.Stop();
  // Streams end first, then browsers, then the threads that answer commands, then calls.
  hub.CloseAll(absl::UnavailableError("the server is shutting down"));
  (*gateway)->Stop();
  engine ? engine->Stop() : replay->replayer().Stop();
  (*rpc)->Stop(std::chrono::milliseconds(500));
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  ShareHeaps();
  Shutdown& shutdown = Shutdown::Listen();
  const auto config = ServerConfig::FromCommandLine(argc, argv);
  if (!config.ok()) {
    SayProblem(config.status());
    return 2;
  }
  if (!config->has_value()) return 0;
  NeverWaitForStandardStreams();
  const absl::Status served = Serve(**config, shutdown);
  // Whatever did not come to be because of the signal is no failure.
  if (served.ok() || shutdown.requested()) return 0;
  SayProblem(served);
  return 1;
}

}  // namespace
}  // namespace saccade

int main(int argc, char** argv) {
  // gRPC's own words for what is said below in one line; whoever wants them sets the variable.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  // TLS 1.3 alone. gRPC 1.51 cannot be asked for that: this names what of 1.2 it may use, and is a
  // cipher that no certificate goes with. Those of 1.3 are another list.
  setenv("GRPC_SSL_CIPHER_SUITES", "PSK-AES256-GCM-SHA384", /*overwrite=*/1);
  try {
    return saccade::Main(argc, argv);
  } catch (const std::exception& error) {  // no memory, no thread
    saccade::SayProblem(absl::InternalError(error.what()));
    return 1;
  }
}
