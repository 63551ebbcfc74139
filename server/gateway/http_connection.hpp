#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/gateway/gateway.hpp"
#include "server/gateway/host_check.hpp"
#include "server/gateway/static_files.hpp"
#include "server/gateway/upstream_call.hpp"
#include "server/pipeline/wearer_port.hpp"

namespace saccade {

/// What every connection of one gateway shares; outlives them.
struct HttpContext {
  StaticFiles files;
  HostCheck hosts;
  std::size_t max_request_bytes = 0;
  std::chrono::milliseconds read_timeout{};
  std::chrono::milliseconds write_timeout{};
  /// Starts a call to the gRPC server.
  std::function<std::shared_ptr<UpstreamCall>(CallRequest, UpstreamCall::Handlers)> call;
  /// New for each certificate, which who is connected does not notice; null: plain.
  std::shared_ptr<boost::asio::ssl::context> tls;
  WearerPort* wearer = nullptr;  // null: no phone can be the camera
  // As GatewayOptions has them.
  std::function<std::optional<GatewayRefusal>(const std::string&, absl::string_view, std::size_t)>
      admit;
  std::string trusted_proxy;
};

/// One browser connection: requests one after the other, on the gateway's thread.
class HttpConnection {
 public:
  /// Starts to serve `socket` for `peer` (its address without the port, which calls carry as
  /// `kPeerMetadata`). Lives until the connection ends; `on_closed` is told then.
  static std::shared_ptr<HttpConnection> Start(boost::asio::ip::tcp::socket socket,
                                               std::string peer, const HttpContext& context,
                                               std::function<void(HttpConnection*)> on_closed);
  virtual ~HttpConnection() = default;
  /// Ends it at once, with whatever call is under way.
  virtual void Close() = 0;
  /// Since when it waits for a whole request; nothing while one is being answered.
  virtual std::optional<std::chrono::steady_clock::time_point> idle_since() const = 0;
  /// Whether a whole request came already.
  virtual bool heard() const = 0;
  /// Of the socket, without the port.
  virtual const std::string& peer() const = 0;
};

}  // namespace saccade
