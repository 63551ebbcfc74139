#include "server/gateway/http_connection.hpp"

#include <array>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace saccade {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
using boost::system::error_code;

constexpr std::size_t kMaxHeaderBytes = 16 * 1024;
// Everything from us, nothing inline, nothing framed: the page needs no more.
constexpr char kContentSecurityPolicy[] =
    "default-src 'none'; script-src 'self'; worker-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; font-src 'self'; manifest-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
// gRPC's numbers, as far as this side needs them.
constexpr int kResourceExhausted = 8;
// Request headers that reach the services as metadata.
constexpr absl::string_view kForwarded[] = {"authorization", "traceparent", "tracestate",
                                            "x-request-id"};

using Request = http::request<http::string_body>;

absl::string_view View(beast::string_view text) { return {text.data(), text.size()}; }

class Connection final : public HttpConnection, public std::enable_shared_from_this<Connection> {
 public:
  Connection(net::ip::tcp::socket socket, const HttpContext& context,
             std::function<void(HttpConnection*)> on_closed)
      : stream_(std::move(socket)), context_(context), on_closed_(std::move(on_closed)) {}
  ~Connection() override { on_closed_(this); }

  void ReadRequest() {
    parser_.emplace();
    parser_->header_limit(kMaxHeaderBytes);
    parser_->body_limit(context_.max_request_bytes);
    stream_.expires_after(context_.read_timeout);
    http::async_read(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](error_code error, std::size_t) { self->OnRequest(error); });
  }

  void Close() override {
    if (std::exchange(closed_, true)) return;
    error_code ignored;
    stream_.socket().shutdown(net::ip::tcp::socket::shutdown_both, ignored);
    stream_.close();
    if (call_) call_->Cancel();
  }

 private:
  void OnRequest(error_code error) {
    if (error == http::error::body_limit) return RefuseTooLarge();
    if (error) return Close();
    const Request& request = parser_->get();
    keep_alive_ = request.keep_alive();
    const absl::string_view host = View(request[http::field::host]);
    if (!context_.hosts.HostAllowed(host)) {
      return Refuse(
          http::status::misdirected_request,
          absl::StrCat("unknown host '", host,
                       "': use localhost, an address, or add it to gateway.allowed_hosts"));
    }
    if (!HostCheck::OriginAllowed(View(request[http::field::origin]), host)) {
      return Refuse(http::status::forbidden, "pages of other origins may not call this server");
    }
    const auto format = GrpcWebFormatOf(View(request[http::field::content_type]));
    if (request.method() == http::verb::post && format) return Forward(*format);
    if (request.method() == http::verb::get || request.method() == http::verb::head) {
      return ServeFile();
    }
    Refuse(http::status::method_not_allowed, "GET a file, or POST gRPC-Web");
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
    const Request& request = parser_->get();
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
    response->set("Permissions-Policy", "camera=(), microphone=(), geolocation=()");
    if (zip) response->set(http::field::content_encoding, "gzip");
    if (!same) response->content_length(body.size());
    if (!same && request.method() == http::verb::get) {
      response->body() = beast::span<const char>(body.data(), body.size());
    }
    WriteWhole(std::move(response));
  }

  void Refuse(http::status status, absl::string_view reason) {
    auto response = std::make_shared<http::response<http::string_body>>(status, 11);
    SetCommonHeaders(*response);
    response->set(http::field::content_type, "text/plain; charset=utf-8");
    response->body() = absl::StrCat(reason, "\n");
    response->prepare_payload();
    if (parser_->get().method() == http::verb::head) response->body().clear();
    WriteWhole(std::move(response));
  }

  // The body stays unread, so the connection ends with the answer.
  void RefuseTooLarge() {
    keep_alive_ = false;
    const auto format = GrpcWebFormatOf(View(parser_->get()[http::field::content_type]));
    if (!format) return Refuse(http::status::payload_too_large, "request too large");
    Fail(*format, kResourceExhausted,
         absl::StrCat("request: larger than ", context_.max_request_bytes, " bytes"));
  }

  template <class Body>
  void WriteWhole(std::shared_ptr<http::response<Body>> response) {
    stream_.expires_after(context_.write_timeout);
    http::async_write(stream_, *response,
                      [self = shared_from_this(), response](error_code error, std::size_t) {
                        self->OnAnswered(error);
                      });
  }

  void OnAnswered(error_code error) {
    if (error || closed_) return Close();
    if (!keep_alive_) return LingerThenClose();
    ReadRequest();
  }

  // Lets an answer sent before the whole request was read arrive: closing at once would reset it.
  void LingerThenClose() {
    error_code ignored;
    stream_.socket().shutdown(net::ip::tcp::socket::shutdown_send, ignored);
    stream_.expires_after(std::chrono::seconds(2));
    Drain();
  }

  void Drain() {
    stream_.async_read_some(net::buffer(drain_),
                            [self = shared_from_this()](error_code error, std::size_t) {
                              if (error) return self->Close();
                              self->Drain();
                            });
  }

  // --- gRPC-Web ---------------------------------------------------------------------------------

  void Forward(GrpcWebFormat format) {
    const Request& request = parser_->get();
    const absl::string_view method = View(request.target());
    if (!IsMethodPath(method)) return Refuse(http::status::not_found, "no such method");
    absl::StatusOr<std::string> message = DecodeGrpcWebRequest(request.body(), format);
    if (!message.ok()) {
      return Fail(format, static_cast<int>(message.status().code()), message.status().message());
    }
    CallRequest call{std::string(method), *std::move(message), {}, {}};
    for (const absl::string_view name : kForwarded) {
      const auto it = request.find(beast::string_view(name.data(), name.size()));
      if (it != request.end()) call.metadata.emplace_back(name, View(it->value()));
    }
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
      // Ends the watch for a disconnect; its handler sees `answering_` and does nothing.
      error_code ignored;
      stream_.socket().cancel(ignored);
      OnAnswered({});
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
    stream_.expires_after(context_.write_timeout);
    net::async_write(
        stream_, net::buffer(out_),
        [self = shared_from_this(), then = std::move(then)](error_code error, std::size_t) {
          if (error || self->closed_) return self->Close();
          self->stream_.expires_never();
          then();
        });
  }

  // While we answer, a browser sends nothing: what can be read is its leaving.
  void WatchForDisconnect() {
    answering_ = true;
    stream_.socket().async_wait(net::ip::tcp::socket::wait_read,
                                [self = shared_from_this()](error_code error) {
                                  if (!error && self->answering_) self->OnReadableWhileAnswering();
                                });
  }

  void OnReadableWhileAnswering() {
    char byte = 0;
    error_code error;
    stream_.socket().non_blocking(true, error);
    const std::size_t size =
        stream_.socket().receive(net::buffer(&byte, 1), net::socket_base::message_peek, error);
    if (error == net::error::would_block) return WatchForDisconnect();
    if (error || size == 0) Close();
    // Otherwise a pipelined request waits in the socket's own buffer until its turn.
  }

  beast::tcp_stream stream_;
  const HttpContext& context_;
  std::function<void(HttpConnection*)> on_closed_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  bool keep_alive_ = false;
  bool closed_ = false;
  bool answering_ = false;
  GrpcWebFormat format_ = GrpcWebFormat::kBinary;
  std::optional<http::response<http::empty_body>> head_;  // until written
  std::string out_;                                       // what is being written
  std::shared_ptr<UpstreamCall> call_;
  std::array<char, 4096> drain_;
};

}  // namespace

std::shared_ptr<HttpConnection> HttpConnection::Start(
    net::ip::tcp::socket socket, const HttpContext& context,
    std::function<void(HttpConnection*)> on_closed) {
  auto connection = std::make_shared<Connection>(std::move(socket), context, std::move(on_closed));
  connection->ReadRequest();
  return connection;
}

}  // namespace saccade
