#include "server/rpc/rpc_server.hpp"

#include <absl/strings/str_cat.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/security/server_credentials.h>

#include "server/rpc/access_service.hpp"
#include "server/rpc/annotation_service.hpp"
#include "server/rpc/calibration_service.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/gaze_service.hpp"
#include "server/rpc/grpc_listener.hpp"
#include "server/rpc/health_service.hpp"
#include "server/rpc/live_pem.hpp"
#include "server/rpc/map_service.hpp"
#include "server/rpc/pointer_board.hpp"
#include "server/rpc/pointer_service.hpp"
#include "server/rpc/recording_service.hpp"
#include "server/rpc/replay_service.hpp"
#include "server/rpc/scene_service.hpp"
#include "server/rpc/session_service.hpp"
#include "server/rpc/surface_service.hpp"
#include "server/rpc/talk_service.hpp"
#include "server/rpc/team_service.hpp"

namespace saccade {
namespace {

void SetArguments(const RpcServerOptions& options, grpc::ServerBuilder& builder) {
  builder.SetMaxReceiveMessageSize(options.max_request_bytes);
  // With probing on, a reader that stops takes seconds of video into the socket (2026, measured:
  // 9.7 s behind after 9 s). These two and Acknowledge bound it.
  builder.AddChannelArgument("grpc.http2.bdp_probe", 0);
  builder.AddChannelArgument("grpc.http2.lookahead_bytes", 65536);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS,
                             static_cast<int>(options.keepalive_time.count()));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS,
                             static_cast<int>(options.keepalive_timeout.count()));
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 256);
  // Who connects and says nothing, or has said nothing for long, holds a descriptor.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, 120'000);
  // Only reflection is synchronous.
  builder.SetSyncServerOption(grpc::ServerBuilder::SyncServerOption::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::SyncServerOption::MIN_POLLERS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::SyncServerOption::MAX_POLLERS, 1);
  builder.SetResourceQuota(grpc::ResourceQuota("rpc").SetMaxThreads(options.max_threads));
}

constexpr unsigned kLookForTls_s = 2;

// `pem` holds key and certificates in one, so that they change together.
std::shared_ptr<grpc::ServerCredentials> CredentialsOf(const LivePem* pem,
                                                       const LivePem* client_ca) {
  if (pem == nullptr) return grpc::InsecureServerCredentials();
  namespace tls = grpc::experimental;
  tls::TlsServerCredentialsOptions options(std::make_shared<tls::FileWatcherCertificateProvider>(
      pem->path(), pem->path(), client_ca == nullptr ? "" : client_ca->path(), kLookForTls_s));
  options.watch_identity_key_cert_pairs();
  if (client_ca != nullptr) {  // who shows none needs a token
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return tls::TlsServerCredentials(options);
}

/// Who links the library has reflection on every server: here on none that asks for tokens, as it
/// asks nobody for one.
class NoReflection final : public grpc::ServerBuilderOption {
  void UpdateArguments(grpc::ChannelArguments*) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    std::erase_if(*plugins, [](const std::unique_ptr<grpc::ServerBuilderPlugin>& plugin) {
      return plugin->name() == "proto_server_reflection";
    });
  }
};

}  // namespace

class RpcServer::Impl {
 public:
  Impl(const RpcServerOptions& options, Backend& backend, StreamHub& hub)
      : hub_(hub),
        sessions_(options.sessions,
                  [this, &backend](const Session& gone) {
                    pointers_.EndParticipant(gone.participant_id);
                    return gone.has_key || backend.Submit(ForgetPerson{gone.person_id}).ok();
                  }),
        pointers_([&backend, &hub](const std::shared_ptr<const PointerList>& pointers) {
          hub.OnPointers(pointers);
          backend.SetPointers(pointers);
        }),
        own_access_(options.access == nullptr ? AccessBook::InMemory({}) : nullptr),
        access_(options.access == nullptr ? *own_access_ : *options.access),
        gate_(sessions_, access_,
              {options.limits, options.traffic, options.machines, options.trusted_proxy}),
        health_service_(gate_),
        access_service_(access_, gate_, options.make_link, options.insecure, options.provider),
        provider_(options.provider),
        session_service_(backend, hub, gate_),
        annotation_service_(backend, gate_),
        map_service_(backend, hub, gate_),
        gaze_service_(backend, gate_),
        pointer_service_(backend, pointers_, gate_),
        scene_service_(backend, gate_),
        surface_service_(backend, gate_),
        calibration_service_(options.calibration, gate_),
        talk_service_(backend, hub, gate_, options.limits.voice_packets),
        team_service_(options.team, gate_),
        recording_service_(options.recording, gate_),
        replay_service_(options.replay, gate_) {
    access_.SetOnEnded([this](const std::vector<std::string>& ids, const absl::Status& why) {
      sessions_.End(ids);
      pointers_.EndAccess(ids);
      hub_.End(ids, why);
      health_service_.End(ids, why);
      team_service_.End(ids, why);
    });
  }
  ~Impl() {
    Stop(std::chrono::milliseconds(500));
    access_.SetOnEnded(nullptr);
  }

  absl::Status Start(const RpcServerOptions& options) {
    grpc::EnableDefaultHealthCheckService(false);  // it would answer anybody: HealthService
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();  // by hand, so that it is linked
    grpc::ServerBuilder builder;
    SetArguments(options, builder);
    if (access_.token_required()) builder.SetOption(std::make_unique<NoReflection>());
    absl::StatusOr<std::unique_ptr<GrpcListener>> listener =
        GrpcListener::Bind(options.host, options.port, options.connections);
    if (!listener.ok()) {
      return absl::UnavailableError(absl::StrCat("grpc: cannot listen on ", options.host, " port ",
                                                 options.port, ": ", listener.status().message(),
                                                 "; choose another with --grpc"));
    }
    if (options.tls) {
      absl::StatusOr<std::unique_ptr<LivePem>> pem = LivePem::Make(Joined(*options.tls));
      if (!pem.ok()) return pem.status();
      pem_ = *std::move(pem);
    }
    if (options.tls && !options.client_ca_pem.empty()) {
      absl::StatusOr<std::unique_ptr<LivePem>> pem = LivePem::Make(options.client_ca_pem);
      if (!pem.ok()) return pem.status();
      client_ca_ = *std::move(pem);
    }
    std::unique_ptr<GrpcListener::Acceptor> acceptor =
        builder.experimental().AddExternalConnectionAcceptor(
            grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
            CredentialsOf(pem_.get(), client_ca_.get()));
    builder.RegisterService(&health_service_);
    builder.RegisterService(&access_service_);
    builder.RegisterService(&session_service_);
    builder.RegisterService(&annotation_service_);
    builder.RegisterService(&map_service_);
    builder.RegisterService(&gaze_service_);
    builder.RegisterService(&pointer_service_);
    builder.RegisterService(&scene_service_);
    builder.RegisterService(&surface_service_);
    builder.RegisterService(&calibration_service_);
    builder.RegisterService(&talk_service_);
    builder.RegisterService(&team_service_);
    builder.RegisterService(&recording_service_);
    builder.RegisterService(&replay_service_);
    server_ = builder.BuildAndStart();
    if (server_ == nullptr) return absl::UnavailableError("grpc: the server could not be started");
    listener_ = *std::move(listener);
    listener_->Start(std::move(acceptor));
    return absl::OkStatus();
  }

  void Stop(std::chrono::milliseconds grace) {
    if (server_ == nullptr) return;
    listener_->Stop();
    hub_.CloseAll(absl::UnavailableError("the server is shutting down"));
    health_service_.Stop();
    team_service_.Stop();
    if (provider_ != nullptr) provider_->Stop();  // its calls are answered
    server_->Shutdown(std::chrono::system_clock::now() + grace);
    server_->Wait();
    server_ = nullptr;
  }

  int port() const { return listener_->port(); }
  Gatekeeper& gate() { return gate_; }
  absl::Status SetTls(const TlsPair& tls) {
    if (pem_ == nullptr) return absl::FailedPreconditionError("tls: this port is plain");
    return pem_->Set(Joined(tls));
  }
  std::shared_ptr<grpc::Channel> InProcessChannel() {
    return server_->InProcessChannel(grpc::ChannelArguments());
  }

 private:
  static std::string Joined(const TlsPair& tls) { return tls.key_pem + tls.chain_pem; }

  StreamHub& hub_;
  SessionTable sessions_;
  PointerBoard pointers_;
  const std::unique_ptr<AccessBook> own_access_;
  AccessBook& access_;
  Gatekeeper gate_;
  HealthService health_service_;
  AccessService access_service_;
  IdentityProvider* const provider_;
  SessionService session_service_;
  AnnotationService annotation_service_;
  MapService map_service_;
  GazeService gaze_service_;
  PointerService pointer_service_;
  SceneService scene_service_;
  SurfaceService surface_service_;
  CalibrationService calibration_service_;
  TalkService talk_service_;
  TeamService team_service_;
  RecordingService recording_service_;
  ReplayService replay_service_;
  std::unique_ptr<LivePem> pem_, client_ca_;  // null: plain; no machines
  std::unique_ptr<GrpcListener> listener_;    // outlives the server, to which its acceptor belongs
  std::unique_ptr<grpc::Server> server_;
};

RpcServer::RpcServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RpcServer::~RpcServer() = default;

absl::StatusOr<std::unique_ptr<RpcServer>> RpcServer::Start(const RpcServerOptions& options,
                                                            Backend& backend, StreamHub& hub) {
  auto impl = std::make_unique<Impl>(options, backend, hub);
  if (absl::Status started = impl->Start(options); !started.ok()) return started;
  return std::unique_ptr<RpcServer>(new RpcServer(std::move(impl)));
}

int RpcServer::port() const { return impl_->port(); }
absl::Status RpcServer::AdmitBrowser(absl::string_view address, absl::string_view authorization,
                                     std::size_t bytes) {
  return impl_->gate().AdmitBrowser(address, authorization, bytes);
}
absl::Status RpcServer::SetTls(const TlsPair& tls) { return impl_->SetTls(tls); }
std::shared_ptr<grpc::Channel> RpcServer::InProcessChannel() { return impl_->InProcessChannel(); }
void RpcServer::Stop(std::chrono::milliseconds grace) { impl_->Stop(grace); }

}  // namespace saccade
