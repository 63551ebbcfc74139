#include "server/rpc/rpc_server.hpp"

#include <absl/strings/str_cat.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>

#include "server/rpc/access_service.hpp"
#include "server/rpc/annotation_service.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/gaze_service.hpp"
#include "server/rpc/grpc_listener.hpp"
#include "server/rpc/map_service.hpp"
#include "server/rpc/session_service.hpp"

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

std::shared_ptr<grpc::ServerCredentials> CredentialsOf(const RpcServerOptions& options) {
  if (!options.tls) return grpc::InsecureServerCredentials();
  grpc::SslServerCredentialsOptions tls;  // of clients no certificate is asked
  tls.pem_key_cert_pairs.push_back({options.tls->key_pem, options.tls->chain_pem});
  return grpc::SslServerCredentials(tls);
}

}  // namespace

class RpcServer::Impl {
 public:
  Impl(const RpcServerOptions& options, Backend& backend, StreamHub& hub)
      : hub_(hub),
        sessions_(
            options.sessions,
            [&backend](const std::string& id) { return backend.Submit(ForgetSession{id}).ok(); }),
        own_access_(options.access == nullptr ? AccessBook::InMemory({}) : nullptr),
        access_(options.access == nullptr ? *own_access_ : *options.access),
        gate_(sessions_, access_, options.limits),
        access_service_(access_, gate_, options.make_link, options.insecure),
        session_service_(backend, hub, gate_),
        annotation_service_(backend, gate_),
        map_service_(backend, hub, gate_),
        gaze_service_(backend, gate_) {
    access_.SetOnEnded([this](const std::vector<std::string>& ids, const absl::Status& why) {
      sessions_.End(ids);
      hub_.End(ids, why);
    });
  }
  ~Impl() {
    Stop(std::chrono::milliseconds(500));
    access_.SetOnEnded(nullptr);
  }

  absl::Status Start(const RpcServerOptions& options) {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    SetArguments(options, builder);
    absl::StatusOr<std::unique_ptr<GrpcListener>> listener =
        GrpcListener::Bind(options.host, options.port);
    if (!listener.ok()) {
      return absl::UnavailableError(absl::StrCat("grpc: cannot listen on ", options.host, " port ",
                                                 options.port, ": ", listener.status().message(),
                                                 "; choose another with --grpc"));
    }
    std::unique_ptr<GrpcListener::Acceptor> acceptor =
        builder.experimental().AddExternalConnectionAcceptor(
            grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
            CredentialsOf(options));
    builder.RegisterService(&access_service_);
    builder.RegisterService(&session_service_);
    builder.RegisterService(&annotation_service_);
    builder.RegisterService(&map_service_);
    builder.RegisterService(&gaze_service_);
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
    server_->Shutdown(std::chrono::system_clock::now() + grace);
    server_->Wait();
    server_ = nullptr;
  }

  int port() const { return listener_->port(); }
  std::shared_ptr<grpc::Channel> InProcessChannel() {
    return server_->InProcessChannel(grpc::ChannelArguments());
  }

 private:
  StreamHub& hub_;
  SessionTable sessions_;
  const std::unique_ptr<AccessBook> own_access_;
  AccessBook& access_;
  Gatekeeper gate_;
  AccessService access_service_;
  SessionService session_service_;
  AnnotationService annotation_service_;
  MapService map_service_;
  GazeService gaze_service_;
  std::unique_ptr<GrpcListener> listener_;  // outlives the server, to which its acceptor belongs
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
std::shared_ptr<grpc::Channel> RpcServer::InProcessChannel() { return impl_->InProcessChannel(); }
void RpcServer::Stop(std::chrono::milliseconds grace) { impl_->Stop(grace); }

}  // namespace saccade
