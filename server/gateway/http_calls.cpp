#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>

#include "server/gateway/http_connection_impl.hpp"

namespace saccade {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
using boost::system::error_code;

// What may come while we answer: the next requests of a client that pipelines.
constexpr std::size_t kMaxPipelinedBytes = 512 * 1024;
// Request headers that reach the services as metadata.
constexpr absl::string_view kForwarded[] = {"authorization", "traceparent", "tracestate",
                                            "x-request-id"};

}  // namespace

void BrowserConnection::Forward(GrpcWebFormat format) {
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
  call.metadata.emplace_back(kPeerMetadata, caller_);
  call.timeout = ParseGrpcTimeout(View(request["grpc-timeout"]));
  BeginAnswer(format);
  WatchForDisconnect();
  call_ = context_.call(
      std::move(call),
      {[self = shared_from_this()](std::string reply) { self->OnMessage(std::move(reply)); },
       [self = shared_from_this()](CallResult result) { self->OnDone(result); }});
}

void BrowserConnection::Fail(GrpcWebFormat format, int code, absl::string_view reason,
                             const std::string& details) {
  BeginAnswer(format);
  OnDone({code, std::string(reason), details, {}});
}

void BrowserConnection::BeginAnswer(GrpcWebFormat format) {
  format_ = format;
  head_.emplace(http::status::ok, 11);
  SetCommonHeaders(*head_);
  const absl::string_view type = ContentTypeOf(format);
  head_->set(http::field::content_type, beast::string_view(type.data(), type.size()));
  head_->set(http::field::cache_control, "no-store");
  head_->chunked(true);
}

void BrowserConnection::OnMessage(std::string reply) {
  if (closed_) return call_->Cancel();
  WriteChunk(EncodeGrpcWebMessage(reply, format_), [this] { call_->ReadNext(); });
}

void BrowserConnection::OnDone(const CallResult& result) {
  call_.reset();
  if (closed_) return;
  WriteChunk(EncodeGrpcWebTrailers(result, format_), [this] { FinishChunks(); });
}

// Head and chunk go in one write; `then` follows when the socket has taken them.
void BrowserConnection::WriteChunk(std::string payload, std::function<void()> then) {
  out_.clear();
  if (head_) {
    out_ = HeadText();
    head_.reset();
  }
  absl::StrAppend(&out_, absl::Hex(payload.size()), "\r\n", payload, "\r\n");
  Write(std::move(then));
}

void BrowserConnection::FinishChunks() {
  out_ = "0\r\n\r\n";
  Write([this] {
    answering_ = false;
    if (!watching_) return OnAnswered({});
    // Ends the watch, whose handler goes on: what it has read may be the next request.
    error_code ignored;
    tcp_.socket().cancel(ignored);
  });
}

std::string BrowserConnection::HeadText() {
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

void BrowserConnection::Write(std::function<void()> then) {
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
void BrowserConnection::WatchForDisconnect() {
  answering_ = true;
  tcp_.expires_never();  // an answer takes as long as it takes
  if (!std::exchange(watching_, true)) Watch();
}

void BrowserConnection::Watch() {
  ReadSome(net::buffer(watched_), [self = shared_from_this()](error_code error, std::size_t size) {
    self->Guarded([&] { self->OnWatched(error, size); });
  });
}

void BrowserConnection::OnWatched(error_code error, std::size_t size) {
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

}  // namespace saccade
