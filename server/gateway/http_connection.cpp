#include "server/gateway/http_connection.hpp"

#include <boost/asio/buffer.hpp>
#include <utility>

#include "absl/strings/match.h"
#include "server/gateway/http_connection_impl.hpp"
#include "server/pipeline/peer_address.hpp"

namespace saccade {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
using boost::system::error_code;

constexpr char kHandshakeRecord = 0x16;  // what a TLS connection begins with
constexpr std::chrono::seconds kHandshakeTimeout(10);
constexpr std::size_t kMaxHeadBytes = 16 * 1024;
constexpr std::size_t kReadBytes = 16 * 1024;
constexpr std::size_t kHeadBytes = 500;  // about what a browser's head is

}  // namespace

void BrowserConnection::Begin(std::string peer) {
  peer_ = std::move(peer);
  Guarded([this] { context_.tls == nullptr ? ReadRequest() : AwaitHandshake(); });
}

void BrowserConnection::Close() {
  if (std::exchange(closed_, true)) return;
  error_code ignored;
  tcp_.socket().shutdown(net::ip::tcp::socket::shutdown_both, ignored);
  tcp_.close();
  if (call_) call_->Cancel();
}

std::optional<std::chrono::steady_clock::time_point> BrowserConnection::idle_since() const {
  return idle_since_;
}

void BrowserConnection::ReadRequest() {
  reader_.emplace(kMaxHeadBytes, context_.max_request_bytes);
  admitted_ = false;
  retry_after_s_.clear();
  idle_since_ = std::chrono::steady_clock::now();
  tcp_.expires_after(context_.read_timeout);  // for the whole request
  TakeRequest();
}

void BrowserConnection::ReadMore() {
  ReadSome(buffer_.prepare(kReadBytes),
           [self = shared_from_this()](error_code error, std::size_t size) {
             if (error) return self->Close();
             self->Guarded([&] {
               self->buffer_.commit(size);
               self->TakeRequest();
             });
           });
}

void BrowserConnection::TakeRequest() {
  switch (reader_->Take(buffer_)) {
    case HttpRequestReader::Result::kNeedMore:
      if (reader_->head_done() && !Admitted()) return;
      return ReadMore();
    case HttpRequestReader::Result::kDone:
      idle_since_.reset();
      heard_ = true;
      if (!Admitted()) return;
      return OnRequest();
    case HttpRequestReader::Result::kBodyTooLarge:
      return RefuseTooLarge();
    case HttpRequestReader::Result::kHeadTooLarge:
      return RefuseAndClose(
          http::status::request_header_fields_too_large,
          absl::StrCat("head, chunk heads and trailers: more than ", kMaxHeadBytes, " bytes"));
    case HttpRequestReader::Result::kMalformed:
      return RefuseAndClose(http::status::bad_request, "not HTTP/1.1");
  }
}

// Before the body is read. A proxy's connection carries many people's requests.
bool BrowserConnection::Admitted() {
  if (std::exchange(admitted_, true)) return true;
  const Request& request = reader_->request();
  caller_ = peer_;
  if (!context_.trusted_proxy.empty() && PlainAddress(peer_) == context_.trusted_proxy) {
    // Of several lines the last one: the proxy wrote it, the others may be anybody's.
    for (const auto& field : request) {
      if (!beast::iequals(field.name_string(), "X-Forwarded-For")) continue;
      std::string told = ForwardedFor(View(field.value()));
      caller_ = told.empty() ? peer_ : std::move(told);
    }
  }
  if (!context_.admit) return true;
  const std::optional<GatewayRefusal> refusal =
      context_.admit(caller_, View(request[http::field::authorization]),
                     kHeadBytes + reader_->announced_body_bytes());
  if (!refusal) return true;
  RefuseTooMuch(*refusal);
  return false;
}

void BrowserConnection::OnRequest() {
  const Request& request = reader_->request();
  keep_alive_ = request.keep_alive();
  const absl::string_view host = View(request[http::field::host]);
  if (!context_.hosts.HostAllowed(host)) {
    return Refuse(http::status::misdirected_request,
                  absl::StrCat("unknown host '", host,
                               "': use localhost, an address, or add it to gateway.allowed_hosts"));
  }
  if (AnsweredInPlain()) return;
  const absl::string_view origin = View(request[http::field::origin]);
  const bool downgraded = tls_ && !origin.empty() && !absl::StartsWith(origin, "https://");
  if (downgraded || !HostCheck::OriginAllowed(origin, host)) {
    return Refuse(http::status::forbidden, "pages of other origins may not call this server");
  }
  if (context_.wearer != nullptr && IsWearerUpgrade(request)) return BecomeWearerSocket();
  const auto format = GrpcWebFormatOf(View(request[http::field::content_type]));
  if (request.method() == http::verb::post && format) return Forward(*format);
  if (request.method() == http::verb::get || request.method() == http::verb::head) {
    return ServeFile();
  }
  Refuse(http::status::method_not_allowed, "GET a file, or POST gRPC-Web");
}

void BrowserConnection::BecomeWearerSocket() {
  // Nobody has anything to say before our answer.
  if (buffer_.size() > 0) return RefuseAndClose(http::status::bad_request, "too early");
  StartWearerSocket({tcp_, tls_ ? &*tls_ : nullptr, reader_->request(), caller_, shared_from_this(),
                     [this] { Close(); }},
                    *context_.wearer);
}

void BrowserConnection::AwaitHandshake() {
  idle_since_ = std::chrono::steady_clock::now();
  tcp_.expires_after(kHandshakeTimeout);
  tcp_.async_read_some(buffer_.prepare(kReadBytes),
                       [self = shared_from_this()](error_code error, std::size_t size) {
                         if (error) return self->Close();
                         self->Guarded([&] {
                           self->buffer_.commit(size);
                           self->Greet();
                         });
                       });
}

// Who speaks plain HTTP here is told where to go: browsers try that first, and a phone that does
// not trust us yet fetches whom to trust.
void BrowserConnection::Greet() {
  if (*static_cast<const char*>(buffer_.data().data()) != kHandshakeRecord) {
    plain_at_tls_ = true;
    return ReadRequest();
  }
  tls_context_ = context_.tls;
  tls_.emplace(tcp_, *tls_context_);
  tls_->async_handshake(net::ssl::stream_base::server, buffer_.data(),
                        [self = shared_from_this()](error_code error, std::size_t used) {
                          // Nobody has anything to say before our answer: what is left over is no
                          // handshake.
                          if (error || used != self->buffer_.size()) return self->Close();
                          self->Guarded([&] {
                            self->buffer_.consume(used);
                            self->ReadRequest();
                          });
                        });
}

// True: it was answered.
bool BrowserConnection::AnsweredInPlain() {
  const Request& request = reader_->request();
  const absl::string_view target = View(request.target());
  if (!plain_at_tls_ || (target == "/trust" || absl::StartsWith(target, "/trust/"))) return false;
  keep_alive_ = false;
  const absl::string_view host = View(request[http::field::host]);
  Refuse(http::status::permanent_redirect, "this server speaks https",
         absl::StrCat("https://", host, target));
  return true;
}

std::shared_ptr<HttpConnection> HttpConnection::Start(
    net::ip::tcp::socket socket, std::string peer, const HttpContext& context,
    std::function<void(HttpConnection*)> on_closed) {
  auto connection =
      std::make_shared<BrowserConnection>(std::move(socket), context, std::move(on_closed));
  connection->Begin(std::move(peer));
  return connection;
}

}  // namespace saccade
