#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/identity/access_book.hpp"
#include "server/identity/identity_provider.hpp"
#include "server/pipeline/calibration.hpp"
#include "server/pipeline/connection_limits.hpp"
#include "server/pipeline/recording.hpp"
#include "server/pipeline/replay.hpp"
#include "server/pipeline/team_port.hpp"
#include "server/rpc/admission.hpp"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/session_table.hpp"
#include "server/rpc/stream_hub.hpp"
#include "server/rpc/traffic_gate.hpp"

namespace grpc {
class Channel;
}

namespace saccade {

/// With what a port shows who it is, as PEM: the certificate with those above it, and its key.
struct TlsPair {
  std::string chain_pem, key_pem;
};

struct RpcServerOptions {
  std::string host = "127.0.0.1";
  int port = 50051;  // 0: any free one, see RpcServer::port
  /// A stroke of 2000 points is 50 KB, a picture up to 1 MB (LargestRequest says what each method
  /// takes). Larger requests: RESOURCE_EXHAUSTED, unparsed.
  int max_request_bytes = 1280 * 1024;
  SessionTableOptions sessions;
  RpcLimits limits;
  TrafficLimits traffic;
  ConnectionLimits connections;
  /// PeerKey of the one proxy whose X-Forwarded-For is believed; empty: nobody's.
  std::string trusted_proxy;
  /// A peer that answers no ping for so long is gone, even if its socket never says so.
  std::chrono::milliseconds keepalive_time{10'000};
  std::chrono::milliseconds keepalive_timeout{20'000};
  /// Reflection is served by threads that wait for their client: no more than these, further ones
  /// get RESOURCE_EXHAUSTED.
  int max_threads = 16;
  /// TLS on the port; nothing: plain.
  std::optional<TlsPair> tls;
  /// PEM of who vouches for machines: a client's certificate by it is an identity, with the role of
  /// `machines`; one by anybody else ends the handshake. Empty: clients are asked for none.
  std::string client_ca_pem;
  MachineRoles machines;
  /// Who may come in; outlives the server. Null: everybody, and invites end with the server.
  AccessBook* access = nullptr;
  /// With whom people sign in; outlives the server, which stops it. Null: nobody does.
  IdentityProvider* provider = nullptr;
  /// Who calibrates the camera; outlives the server. Null: nobody.
  CalibrationPort* calibration = nullptr;
  /// Who records; outlives the server. Null: nobody.
  RecordingPort* recording = nullptr;
  /// The recording that is played in an engine's place; outlives the server. Null: none.
  ReplayPort* replay = nullptr;
  /// This server's part in a team; outlives the server. Null: none.
  TeamPort* team = nullptr;
  /// What a browser opens with an invite. Any thread.
  std::function<std::string(AccessRole, const std::string& token)> make_link;
  bool insecure = false;  // plain beyond loopback: told to every page
};

/// The gRPC server: every service of saccade.v1 and health; reflection where nobody needs a token.
class RpcServer {
 public:
  /// Binds and serves. `backend` and `hub` (connected to it) outlive the server.
  /// Unavailable: the address cannot be bound, naming it.
  static absl::StatusOr<std::unique_ptr<RpcServer>> Start(const RpcServerOptions& options,
                                                          Backend& backend, StreamHub& hub);
  ~RpcServer();

  int port() const;
  /// For the gateway, before it reads what a browser sends: Gatekeeper::AdmitBrowser. Any thread,
  /// while the server lives.
  absl::Status AdmitBrowser(absl::string_view address, absl::string_view authorization,
                            std::size_t bytes);
  /// For the gateway: calls that do not pass a socket. Only while the server runs.
  std::shared_ptr<grpc::Channel> InProcessChannel();

  /// Another certificate for who connects from now on, within some seconds; who is connected stays.
  /// FailedPrecondition: the port is plain.
  absl::Status SetTls(const TlsPair& tls);

  /// Ends the streams, lets calls finish for `grace`, then cancels them. May be called twice.
  void Stop(std::chrono::milliseconds grace);

 private:
  class Impl;
  explicit RpcServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
