#include "server/gateway/gateway.hpp"

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <exception>
#include <thread>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/gateway/http_connection.hpp"
#include "server/gateway/trust_page.hpp"
#include "server/pipeline/descriptors.hpp"
#include "server/pipeline/peer_address.hpp"
#include "shared/io/log.hpp"

namespace saccade {

namespace net = boost::asio;
using boost::system::error_code;
using net::ip::tcp;

absl::Status GatewayOptions::Validate() const {
  if (port < 0 || port > 65535) {
    return absl::InvalidArgumentError(absl::StrCat("gateway.port: ", port, " is not 0 to 65535"));
  }
  if (max_request_bytes == 0) {
    return absl::InvalidArgumentError("gateway.max_request_bytes: 0; give at least 1");
  }
  if (connections.all <= 0) {
    return absl::InvalidArgumentError("gateway.connections: give at least 1");
  }
  if (read_timeout.count() <= 0 || write_timeout.count() <= 0) {
    return absl::InvalidArgumentError("gateway.read_timeout, write_timeout: give more than 0");
  }
  error_code error;
  net::ip::make_address(host, error);
  if (error) {
    return absl::InvalidArgumentError(
        absl::StrCat("gateway.host: '", host, "' is not an IP address, e.g. 127.0.0.1"));
  }
  return absl::OkStatus();
}

class Gateway::Impl {
 public:
  Impl(const GatewayOptions& options, std::shared_ptr<grpc::Channel> channel, StaticFiles files)
      : options_(options),
        context_{std::move(files),
                 HostCheck(options.allowed_hosts),
                 options.max_request_bytes,
                 options.read_timeout,
                 options.write_timeout,
                 {},
                 nullptr,
                 options.wearer,
                 options.admit,
                 options.trusted_proxy},
        gate_(options.connections) {
    context_.call = [this, channel = std::move(channel)](CallRequest request,
                                                         UpstreamCall::Handlers handlers) {
      // The guard keeps `Run` going until the call is over, so that its end is never lost.
      auto guard = std::make_shared<net::executor_work_guard<net::io_context::executor_type>>(
          io_.get_executor());
      UpstreamCall::Post post = [guard](std::function<void()> task) {
        net::post(guard->get_executor(), std::move(task));
      };
      return UpstreamCall::Start(channel, std::move(request), std::move(post), std::move(handlers));
    };
  }

  absl::Status Listen() {
    if (absl::Status ready = PrepareTls(); !ready.ok()) return ready;
    error_code error;
    const tcp::endpoint endpoint(net::ip::make_address(options_.host),
                                 static_cast<std::uint16_t>(options_.port));
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(net::socket_base::max_listen_connections, error);
    if (error) {
      return absl::UnavailableError(absl::StrCat("HTTP ", options_.host, ":", options_.port, ": ",
                                                 error.message(),
                                                 "; choose another with --http HOST:PORT"));
    }
    port_ = acceptor_.local_endpoint().port();
    Accept();
    thread_ = std::jthread([this] { Run(); });
    return absl::OkStatus();
  }

  void Stop() {
    if (!thread_.joinable()) return;
    net::post(io_, [this] {
      stopping_ = true;
      error_code ignored;
      acceptor_.close(ignored);
      retry_.cancel();
      const auto connections = connections_;  // Close may end some
      for (const auto& [raw, weak] : connections) {
        if (const auto connection = weak.lock()) connection->Close();
      }
    });
    thread_.join();  // when every connection and call has ended
  }

  int port() const { return port_; }

  absl::Status SetTls(const std::string& chain_pem, const std::string& key_pem,
                      const std::string& root_pem, const std::string& root_sha256) {
    absl::StatusOr<Tls> tls = MakeTls(chain_pem, key_pem);
    if (!tls.ok()) return tls.status();
    net::post(io_, [this, tls = *std::move(tls), root_pem, root_sha256] {
      context_.tls = tls;
      if (root_pem.empty() || root_pem == options_.root_pem) return;
      options_.root_pem = root_pem;
      AddTrustPage(root_pem, root_sha256, context_.files);
    });
    return absl::OkStatus();
  }

 private:
  absl::Status PrepareTls() {
    if (options_.tls_chain_pem.empty()) return absl::OkStatus();
    auto tls = MakeTls(options_.tls_chain_pem, options_.tls_key_pem);
    if (!tls.ok()) return tls.status();
    context_.tls = *std::move(tls);
    return absl::OkStatus();
  }

  using Tls = std::shared_ptr<net::ssl::context>;
  static absl::StatusOr<Tls> MakeTls(const std::string& chain, const std::string& key) {
    auto tls = std::make_shared<net::ssl::context>(net::ssl::context::tls_server);
    error_code error;
    tls->use_certificate_chain(net::buffer(chain), error);
    if (!error) tls->use_private_key(net::buffer(key), net::ssl::context::pem, error);
    if (error) {
      return absl::InvalidArgumentError(absl::StrCat("tls: certificate or key: ", error.message()));
    }
    SSL_CTX_set_min_proto_version(tls->native_handle(), TLS1_3_VERSION);
    SSL_CTX_set_alpn_select_cb(tls->native_handle(), ChooseHttp11, nullptr);
    return tls;
  }

  static int ChooseHttp11(SSL*, const unsigned char** out, unsigned char* size,
                          const unsigned char* offered, unsigned offered_size, void*) {
    static constexpr unsigned char kOurs[] = "\x08http/1.1";
    unsigned char* chosen = nullptr;
    if (SSL_select_next_proto(&chosen, size, kOurs, sizeof(kOurs) - 1, offered, offered_size) !=
        OPENSSL_NPN_NEGOTIATED) {
      return SSL_TLSEXT_ERR_NOACK;
    }
    *out = chosen;
    return SSL_TLSEXT_ERR_OK;
  }

  void Accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (stopping_) return;
      if (!error) {
        Serve(std::move(socket));
        return Accept();
      }
      // Out of file descriptors, most likely: wait instead of spinning.
      retry_.expires_after(std::chrono::milliseconds(100));
      retry_.async_wait([this](error_code cancelled) {
        if (!cancelled && !stopping_) Accept();
      });
    });
  }

  // Connections guard their own handlers; whatever is thrown beside them must not end the process.
  void Run() {
    for (;;) {
      try {
        io_.run();
        return;
      } catch (const std::exception& thrown) {
        Log(absl::StrCat("gateway: ", Printable(thrown.what())));
      }
    }
  }

  void Serve(tcp::socket socket) {
    error_code error;
    const tcp::endpoint peer = socket.remote_endpoint(error);
    if (error) return;  // gone already
    // An IPv4 caller of a socket for both is himself, not the network ::ffff:0:0.
    net::ip::address address = peer.address();
    if (address.is_v6() && address.to_v6().is_v4_mapped()) {
      address = net::ip::make_address_v4(net::ip::v4_mapped, address.to_v6());
    }
    const std::string caller = address.to_string();
    if (!gate_.IsProxy(caller) && !Welcome(caller)) return;
    if (DescriptorsRunOut(socket.native_handle()) ||
        connections_.size() >= static_cast<std::size_t>(options_.connections.all)) {
      if (!CloseLongestIdle()) return;
    }
    socket.set_option(tcp::no_delay(true), error);
    NoticeDeadPeer(socket.native_handle());
    const auto connection =
        HttpConnection::Start(std::move(socket), address.to_string(), context_,
                              [this](HttpConnection* gone) { connections_.erase(gone); });
    connections_[connection.get()] = connection;
  }

  bool Welcome(const std::string& address) {
    const std::string peer = PeerKey(address);
    const Timestamp now_ns = MonotonicNow();
    absl::Status status = gate_.Hurry(peer, now_ns);
    if (status.ok() && gate_.Counts(peer)) {
      ConnectionCounts counts;
      const std::string network = NetworkKey(peer);
      for (const auto& [raw, weak] : connections_) {
        const std::string other = PeerKey(raw->peer());
        if (NetworkKey(other) == network) ++counts.of_network;
        if (other != peer) continue;
        ++counts.of_address;
        if (!raw->heard()) ++counts.unheard_of_address;
      }
      status = gate_.Admit(peer, counts);
    }
    if (!status.ok() && now_ns - said_ns_ > 1'000'000'000) {
      said_ns_ = now_ns;
      Log(absl::StrCat("gateway: ", peer, " was turned away: ", status.message()));
    }
    return status.ok();
  }

  // Who connects and asks nothing must not keep out who asks. False: nobody is idle.
  bool CloseLongestIdle() {
    std::shared_ptr<HttpConnection> longest;
    for (const auto& [raw, weak] : connections_) {
      const auto connection = weak.lock();
      if (!connection || !connection->idle_since()) continue;
      if (!longest || *connection->idle_since() < *longest->idle_since()) longest = connection;
    }
    if (longest) longest->Close();
    return longest != nullptr;
  }

  GatewayOptions options_;
  HttpContext context_;
  ConnectionGate gate_;
  Timestamp said_ns_ = 0;
  std::unordered_map<HttpConnection*, std::weak_ptr<HttpConnection>> connections_;
  bool stopping_ = false;
  int port_ = 0;
  net::io_context io_{1};  // destroyed before what its handlers point to
  tcp::acceptor acceptor_{io_};
  net::steady_timer retry_{io_};
  std::jthread thread_;
};

absl::StatusOr<std::unique_ptr<Gateway>> Gateway::Start(const GatewayOptions& options,
                                                        std::shared_ptr<grpc::Channel> channel) {
  if (const absl::Status valid = options.Validate(); !valid.ok()) return valid;
  absl::StatusOr<StaticFiles> files = StaticFiles::Load(options.web_root);
  if (!files.ok()) return files.status();
  if (!options.root_pem.empty()) AddTrustPage(options.root_pem, options.root_sha256, *files);
  auto impl = std::make_unique<Impl>(options, std::move(channel), *std::move(files));
  if (const absl::Status listening = impl->Listen(); !listening.ok()) return listening;
  return std::unique_ptr<Gateway>(new Gateway(std::move(impl)));
}

Gateway::Gateway(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Gateway::~Gateway() { Stop(); }
int Gateway::port() const { return impl_->port(); }
void Gateway::Stop() { impl_->Stop(); }
absl::Status Gateway::SetTls(const std::string& chain_pem, const std::string& key_pem,
                             const std::string& root_pem, const std::string& root_sha256) {
  return impl_->SetTls(chain_pem, key_pem, root_pem, root_sha256);
}

}  // namespace saccade
