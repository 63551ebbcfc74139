#include "server/gateway/http_connection.hpp"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/gateway/http_request_reader.hpp"
#include "server/gateway/wearer_socket.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
using boost::system::error_code;

constexpr char kHandshakeRecord = 0x16;  // what a TLS connection begins with
constexpr std::chrono::seconds kHandshakeTimeout(10);
constexpr std::size_t kMaxHeadBytes = 16 * 1024;
// What may come while we answer: the next requests of a client that pipelines.
constexpr std::size_t kMaxPipelinedBytes = 512 * 1024;
// Everything from us, nothing inline, nothing framed: the page needs no more.
constexpr char kContentSecurityPolicy[] =
    "default-src 'none'; script-src 'self'; worker-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; font-src 'self'; manifest-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
// gRPC's numbers, as far as this side needs them.
constexpr int kResourceExhausted = 8;
// Request headers that reach the services as metadata.
constexpr std::size_t kReadBytes = 16 * 1024;
constexpr absl::string_view kForwarded[] = {"authorization", "traceparent", "tracestate",
                                            "x-request-id"};

using Request = HttpRequestReader::Request;

/// What a page may ask the browser's user for: the wearer's phone for its camera and its motion.
const char* PermissionsOf(absl::string_view target) {
  const absl::string_view path = target.substr(0, target.find_first_of("?#"));
  return path == "/wear" || path == "/wear.html"
             ? "camera=(self), accelerometer=(self), gyroscope=(self), screen-wake-lock=(self), "
               "microphone=(), geolocation=()"
             : "camera=(), microphone=(), geolocation=()";
}

absl::string_view View(beast::string_view text) { return {text.data(), text.size()}; }

class Connection final : public HttpConnection, public std::enable_shared_from_this<Connection> {
 public:
  Connection(net::ip::tcp::socket socket, const HttpContext& context,
             std::function<void(HttpConnection*)> on_closed)
      : tcp_(std::move(socket)), context_(context), on_closed_(std::move(on_closed)) {}
  ~Connection() override { on_closed_(this); }

  void Begin(std::string peer) {
    peer_ = std::move(peer);
    Guarded([this] { context_.tls == nullptr ? ReadRequest() : AwaitHandshake(); });
  }

  void Close() override {
    if (std::exchange(closed_, true)) return;
    error_code ignored;
    tcp_.socket().shutdown(net::ip::tcp::socket::shutdown_both, ignored);
    tcp_.close();
    if (call_) call_->Cancel();
  }

  std::optional<std::chrono::steady_clock::time_point> idle_since() const override {
    return idle_since_;
  }

 private:
  // Whatever is thrown below costs this connection only.
  template <class Work>
  void Guarded(Work work) {
    try {
      work();
    } catch (const std::exception& thrown) {
      Log(absl::StrCat("gateway: ", peer_, ": ", Printable(thrown.what())));
      Close();
    }
  }

  // --- TLS --------------------------------------------------------------------------------------

  void AwaitHandshake() {
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
  void Greet() {
    if (*static_cast<const char*>(buffer_.data().data()) != kHandshakeRecord) {
      plain_at_tls_ = true;
      return ReadRequest();
    }
    tls_.emplace(tcp_, *context_.tls);
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

  template <class Buffers, class Handler>
  void ReadSome(const Buffers& buffers, Handler handler) {
    if (tls_) return tls_->async_read_some(buffers, std::move(handler));
    tcp_.async_read_some(buffers, std::move(handler));
  }

  // True: it was answered.
  bool AnsweredInPlain() {
    const Request& request = reader_->request();
    const absl::string_view target = View(request.target());
    if (!plain_at_tls_ || (target == "/trust" || absl::StartsWith(target, "/trust/"))) return false;
    keep_alive_ = false;
    const absl::string_view host = View(request[http::field::host]);
    Refuse(http::status::permanent_redirect, "this server speaks https",
           absl::StrCat("https://", host, target));
    return true;
  }

  void ReadRequest() {
    reader_.emplace(kMaxHeadBytes, context_.max_request_bytes);
    idle_since_ = std::chrono::steady_clock::now();
    tcp_.expires_after(context_.read_timeout);  // for the whole request
    TakeRequest();
  }

  void ReadMore() {
    ReadSome(buffer_.prepare(kReadBytes),
             [self = shared_from_this()](error_code error, std::size_t size) {
               if (error) return self->Close();
               self->Guarded([&] {
                 self->buffer_.commit(size);
                 self->TakeRequest();
               });
             });
  }

  void TakeRequest() {
    switch (reader_->Take(buffer_)) {
      case HttpRequestReader::Result::kNeedMore:
        return ReadMore();
      case HttpRequestReader::Result::kDone:
        idle_since_.reset();
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

  void OnRequest() {
    const Request& request = reader_->request();
    keep_alive_ = request.keep_alive();
    const absl::string_view host = View(request[http::field::host]);
    if (!context_.hosts.HostAllowed(host)) {
      return Refuse(
          http::status::misdirected_request,
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

  void BecomeWearerSocket() {
    // Nobody has anything to say before our answer.
    if (buffer_.size() > 0) return RefuseAndClose(http::status::bad_request, "too early");
    StartWearerSocket({tcp_, tls_ ? &*tls_ : nullptr, reader_->request(), peer_, shared_from_this(),
                       [this] { Close(); }},
                      *context_.wearer);
  }

  // --- Files ------------------------------------------------------------------------------------

  template <class Body>
  void SetCommonHeaders(http::response<Body>& response) {
    response.keep_alive(keep_alive_);
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Referrer-Policy", "no-referrer");
    response.set("Cross-Origin-Opener-Policy", "same-origin");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
  }

  void ServeFile() {
    const Request& request = reader_->request();
    const StaticFile* file = context_.files.Find(View(request.target()));
    if (file == nullptr) return Refuse(http::status::not_found, "no such page");
    const bool same = View(request[http::field::if_none_match]) == file->etag;
    const bool zip = !same && !file->gzip_body.empty() &&
                     absl::StrContains(View(request[http::field::accept_encoding]), "gzip");
    const std::string& body = zip ? file->gzip_body : file->body;
    auto response = std::make_shared<http::response<http::span_body<const char>>>(
        same ? http::status::not_modified : http::status::ok, 11);
    SetCommonHeaders(*response);
    response->set(http::field::content_type, file->content_type);
    response->set(http::field::cache_control, file->cache_control);
    response->set(http::field::etag, file->etag);
    response->set(http::field::vary, "Accept-Encoding");
    response->set("Content-Security-Policy", kContentSecurityPolicy);
    response->set("Permissions-Policy", PermissionsOf(View(request.target())));
    if (zip) response->set(http::field::content_encoding, "gzip");
    if (!same) response->content_length(body.size());
    if (!same && request.method() == http::verb::get) {
      response->body() = beast::span<const char>(body.data(), body.size());
    }
    WriteWhole(std::move(response));
  }

  void Refuse(http::status status, absl::string_view reason, const std::string& location = "") {
    auto response = std::make_shared<http::response<http::string_body>>(status, 11);
    SetCommonHeaders(*response);
    if (!location.empty()) response->set(http::field::location, location);
    response->set(http::field::content_type, "text/plain; charset=utf-8");
    response->body() = absl::StrCat(reason, "\n");
    response->prepare_payload();
    if (reader_->request().method() == http::verb::head) response->body().clear();
    WriteWhole(std::move(response));
  }

  // The rest stays unread, so the connection ends with the answer.
  void RefuseAndClose(http::status status, absl::string_view reason) {
    idle_since_.reset();
    keep_alive_ = false;
    Refuse(status, reason);
  }

  void RefuseTooLarge() {
    idle_since_.reset();
    keep_alive_ = false;
    const auto format = GrpcWebFormatOf(View(reader_->request()[http::field::content_type]));
    if (!format) return Refuse(http::status::payload_too_large, "request too large");
    Fail(*format, kResourceExhausted,
         absl::StrCat("request: larger than ", context_.max_request_bytes, " bytes"));
  }

  template <class Body>
  void WriteWhole(std::shared_ptr<http::response<Body>> response) {
    tcp_.expires_after(context_.write_timeout);
    auto done = [self = shared_from_this(), response](error_code error, std::size_t) {
      self->Guarded([&] { self->OnAnswered(error); });
    };
    if (tls_) return http::async_write(*tls_, *response, std::move(done));
    http::async_write(tcp_, *response, std::move(done));
  }

  void OnAnswered(error_code error) {
    if (error || closed_) return Close();
    if (!keep_alive_) return LingerThenClose();
    ReadRequest();
  }

  // Lets an answer sent before the whole request was read arrive: closing at once would reset it.
  void LingerThenClose() {
    tcp_.expires_after(std::chrono::seconds(2));
    if (tls_) {
      return tls_->async_shutdown([self = shared_from_this()](error_code) { self->Close(); });
    }
    error_code ignored;
    tcp_.socket().shutdown(net::ip::tcp::socket::shutdown_send, ignored);
    Drain();
  }

  void Drain() {
    tcp_.async_read_some(net::buffer(drain_),
                         [self = shared_from_this()](error_code error, std::size_t) {
                           if (error) return self->Close();
                           self->Drain();
                         });
  }

  // --- gRPC-Web ---------------------------------------------------------------------------------

  void Forward(GrpcWebFormat format) {
    const Request& request = reader_->request();
    const absl::string_view method = View(request.target());
    if (!IsMethodPath(method)) return Refuse(http::status::not_found, "no such method");
    absl::StatusOr<std::string> message = DecodeGrpcWebRequest(request.body(), format);
    if (!message.ok()) {
      return Fail(format, static_cast<int>(message.status().code()), message.status().message());
    }
    CallRequest call{std::string(method), *std::move(message), {}, {}};
    for (const absl::string_view name : kForwarded) {
      const auto it = request.find(beast::string_view(name.data(), name.size()));
      if (it == request.end()) continue;
      if (!IsMetadataValue(View(it->value()))) {
        return Refuse(http::status::bad_request,
                      absl::StrCat(name, ": holds a byte that is not printable ASCII"));
      }
      call.metadata.emplace_back(name, View(it->value()));
    }
    call.metadata.emplace_back(kPeerMetadata, peer_);
    call.timeout = ParseGrpcTimeout(View(request["grpc-timeout"]));
    BeginAnswer(format);
    WatchForDisconnect();
    call_ = context_.call(
        std::move(call),
        {[self = shared_from_this()](std::string reply) { self->OnMessage(std::move(reply)); },
         [self = shared_from_this()](CallResult result) { self->OnDone(result); }});
  }

  void Fail(GrpcWebFormat format, int code, absl::string_view reason) {
    BeginAnswer(format);
    OnDone({code, std::string(reason), {}, {}});
  }

  void BeginAnswer(GrpcWebFormat format) {
    format_ = format;
    head_.emplace(http::status::ok, 11);
    SetCommonHeaders(*head_);
    const absl::string_view type = ContentTypeOf(format);
    head_->set(http::field::content_type, beast::string_view(type.data(), type.size()));
    head_->set(http::field::cache_control, "no-store");
    head_->chunked(true);
  }

  void OnMessage(std::string reply) {
    if (closed_) return call_->Cancel();
    WriteChunk(EncodeGrpcWebMessage(reply, format_), [this] { call_->ReadNext(); });
  }

  void OnDone(const CallResult& result) {
    call_.reset();
    if (closed_) return;
    WriteChunk(EncodeGrpcWebTrailers(result, format_), [this] { FinishChunks(); });
  }

  // Head and chunk go in one write; `then` follows when the socket has taken them.
  void WriteChunk(std::string payload, std::function<void()> then) {
    out_.clear();
    if (head_) {
      out_ = HeadText();
      head_.reset();
    }
    absl::StrAppend(&out_, absl::Hex(payload.size()), "\r\n", payload, "\r\n");
    Write(std::move(then));
  }

  void FinishChunks() {
    out_ = "0\r\n\r\n";
    Write([this] {
      answering_ = false;
      if (!watching_) return OnAnswered({});
      // Ends the watch, whose handler goes on: what it has read may be the next request.
      error_code ignored;
      tcp_.socket().cancel(ignored);
    });
  }

  std::string HeadText() {
    http::response_serializer<http::empty_body> serializer(*head_);
    serializer.split(true);
    std::string text;
    error_code error;
    while (!error && !serializer.is_header_done()) {
      serializer.next(error, [&](error_code&, const auto& buffers) {
        text += beast::buffers_to_string(buffers);
        serializer.consume(beast::buffer_bytes(buffers));
      });
    }
    return text;
  }

  void Write(std::function<void()> then) {
    tcp_.expires_after(context_.write_timeout);
    auto done = [self = shared_from_this(), then = std::move(then)](error_code error, std::size_t) {
      if (error || self->closed_) return self->Close();
      self->tcp_.expires_never();
      self->Guarded(then);
    };
    if (tls_) return net::async_write(*tls_, net::buffer(out_), std::move(done));
    net::async_write(tcp_, net::buffer(out_), std::move(done));
  }

  // While we answer, a browser sends nothing: what can be read is its leaving. What a client that
  // pipelines sends is kept for its turn; it must be read, or the end behind it is never seen.
  void WatchForDisconnect() {
    answering_ = true;
    tcp_.expires_never();  // an answer takes as long as it takes
    if (!std::exchange(watching_, true)) Watch();
  }

  void Watch() {
    ReadSome(net::buffer(watched_),
             [self = shared_from_this()](error_code error, std::size_t size) {
               self->Guarded([&] { self->OnWatched(error, size); });
             });
  }

  void OnWatched(error_code error, std::size_t size) {
    watching_ = false;
    if (closed_) return;
    if (size > 0) {
      net::buffer_copy(buffer_.prepare(size), net::buffer(watched_, size));
      buffer_.commit(size);
    }
    if (!answering_ && (!error || error == net::error::operation_aborted)) return OnAnswered({});
    if (error || buffer_.size() > kMaxPipelinedBytes) return Close();
    watching_ = true;
    Watch();
  }

  beast::tcp_stream tcp_;
  std::optional<TlsStream> tls_;  // over tcp_; nothing: plain
  bool plain_at_tls_ = false;     // plain HTTP where TLS is spoken
  const HttpContext& context_;
  std::function<void(HttpConnection*)> on_closed_;
  beast::flat_buffer buffer_;
  std::optional<HttpRequestReader> reader_;
  std::string peer_;                                                 // address without port
  std::optional<std::chrono::steady_clock::time_point> idle_since_;  // nothing is asked of us
  bool keep_alive_ = false;
  bool closed_ = false;
  bool answering_ = false;
  bool watching_ = false;
  GrpcWebFormat format_ = GrpcWebFormat::kBinary;
  std::optional<http::response<http::empty_body>> head_;  // until written
  std::string out_;                                       // what is being written
  std::shared_ptr<UpstreamCall> call_;
  std::array<char, 4096> drain_;
  std::array<char, 4096> watched_;
};

}  // namespace

std::shared_ptr<HttpConnection> HttpConnection::Start(
    net::ip::tcp::socket socket, std::string peer, const HttpContext& context,
    std::function<void(HttpConnection*)> on_closed) {
  auto connection = std::make_shared<Connection>(std::move(socket), context, std::move(on_closed));
  connection->Begin(std::move(peer));
  return connection;
}

}  // namespace saccade
