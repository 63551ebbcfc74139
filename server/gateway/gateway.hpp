#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/pipeline/connection_limits.hpp"

namespace grpc {
class Channel;
}

namespace saccade {

class WearerPort;

/// Why a request is not served: it, or what came before it, was too much.
struct GatewayRefusal {
  int code = 8;         // as in gRPC
  std::string message;  // with the limit
  std::string details;  // google.rpc.Status with RetryInfo, encoded
  std::chrono::nanoseconds retry_after{};
};

/// How the gateway serves browsers.
struct GatewayOptions {
  std::string host = "127.0.0.1";  ///< address to bind, an IP literal
  int port = 8080;                 ///< 0: any free one, see `Gateway::port`
  /// The built page (web/dist). Read once at start; absent or empty: a page that says how to build
  /// it is served in its place.
  std::filesystem::path web_root;
  /// Names that browsers may use for this server, besides `localhost`, IP literals and this
  /// machine's own name. Any other Host is refused: a foreign name that resolves to this address is
  /// how a foreign page would get in (DNS rebinding).
  std::vector<std::string> allowed_hosts;
  std::size_t max_request_bytes = 4 * 1024 * 1024;  ///< body of one RPC
  /// Of `all`, further ones take the place of who has been idle for longest.
  ConnectionLimits connections;
  /// Asked with the head of each request, before its body is read: the caller's address, its
  /// Authorization, and the bytes to come. Null: everything is served. On the gateway's thread.
  std::function<std::optional<GatewayRefusal>(const std::string& address,
                                              absl::string_view authorization, std::size_t bytes)>
      admit;
  /// Address of the one proxy whose X-Forwarded-For says who calls; empty: nobody's does.
  std::string trusted_proxy;
  std::chrono::milliseconds read_timeout{60'000};  ///< an idle or slow request
  /// One piece of an answer not taken by the browser for so long ends its connection.
  std::chrono::milliseconds write_timeout{30'000};

  /// TLS 1.3, with this certificate (and those above it) and key as PEM; empty: plain.
  std::string tls_chain_pem, tls_key_pem;
  /// Whom to trust, offered at /trust with how to; empty: nobody special.
  std::string root_pem, root_sha256;

  /// Where the WebSocket /wear/upstream leads; null: nowhere. Outlives the gateway.
  WearerPort* wearer = nullptr;

  /// InvalidArgument names the field and the remedy.
  absl::Status Validate() const;
};

/// HTTP/1.1 server for browsers: the web page's files and gRPC-Web, with TLS or without.
///
/// Where TLS is spoken, plain HTTP gets /trust and below; anything else is sent to https.
///
/// Every method of the server is reachable (unary and server streaming) without code here: requests
/// are translated through `grpc::GenericStub`. One thread of its own; calls wait on gRPC's threads.
/// A message is asked of gRPC only when the one before has been written to the browser's socket, so
/// a slow browser costs at most one message of memory and the services see its slowness.
class Gateway {
 public:
  /// Binds and serves until `Stop`. `channel` is usually `grpc::Server::InProcessChannel`; the
  /// server behind it must outlive the gateway. Errors:
  ///   InvalidArgument  options, naming the field
  ///   Unavailable      the address cannot be bound, naming it
  static absl::StatusOr<std::unique_ptr<Gateway>> Start(const GatewayOptions& options,
                                                        std::shared_ptr<grpc::Channel> channel);
  ~Gateway();
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  /// The port bound.
  int port() const;

  /// Another certificate and key for who connects from now on, and the root that is to be trusted
  /// (as GatewayOptions has it); who is connected stays. Only where TLS is spoken.
  /// InvalidArgument: they cannot be used, and nothing changes.
  absl::Status SetTls(const std::string& chain_pem, const std::string& key_pem,
                      const std::string& root_pem = "", const std::string& root_sha256 = "");

  /// Cancels what is under way, closes every connection, joins the thread. May be called twice.
  void Stop();

 private:
  class Impl;
  explicit Gateway(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
