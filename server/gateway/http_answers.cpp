#include <algorithm>
#include <boost/asio/buffer.hpp>

#include "absl/strings/match.h"
#include "server/gateway/http_connection_impl.hpp"

namespace saccade {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
using boost::system::error_code;

// Everything from us, nothing inline, nothing framed: the page needs no more. WebAssembly unpacks
// surfaces; of scripts that are made from text that allows none.
constexpr char kContentSecurityPolicy[] =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src "
    "'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; font-src 'self'; manifest-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
// gRPC's numbers, as far as this side needs them.
constexpr int kResourceExhausted = 8;

/// What a page may ask the browser's user for: all for the microphone, to talk; the wearer's phone
/// for its camera and its motion.
const char* PermissionsOf(absl::string_view target) {
  const absl::string_view path = target.substr(0, target.find_first_of("?#"));
  return path == "/wear" || path == "/wear.html"
             ? "camera=(self), accelerometer=(self), gyroscope=(self), screen-wake-lock=(self), "
               "microphone=(self), geolocation=()"
             : "camera=(), microphone=(self), geolocation=()";
}

}  // namespace

void BrowserConnection::ServeFile() {
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

void BrowserConnection::Refuse(http::status status, absl::string_view reason,
                               const std::string& location) {
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
void BrowserConnection::RefuseAndClose(http::status status, absl::string_view reason) {
  idle_since_.reset();
  keep_alive_ = false;
  Refuse(status, reason);
}

void BrowserConnection::RefuseTooLarge() {
  idle_since_.reset();
  keep_alive_ = false;
  const auto format = GrpcWebFormatOf(View(reader_->request()[http::field::content_type]));
  if (!format) return Refuse(http::status::payload_too_large, "request too large");
  Fail(*format, kResourceExhausted,
       absl::StrCat("request: larger than ", context_.max_request_bytes, " bytes"));
}

// What was read whole leaves the connection to the next request, which may be another's.
void BrowserConnection::RefuseTooMuch(const GatewayRefusal& refusal) {
  const Request& request = reader_->request();
  keep_alive_ = !idle_since_.has_value() && request.keep_alive();
  idle_since_.reset();
  const auto seconds = std::chrono::ceil<std::chrono::seconds>(refusal.retry_after);
  retry_after_s_ = absl::StrCat(std::max<std::int64_t>(1, seconds.count()));
  const auto format = GrpcWebFormatOf(View(request[http::field::content_type]));
  if (!format) return Refuse(http::status::too_many_requests, refusal.message);
  Fail(*format, refusal.code, refusal.message, refusal.details);
}

void BrowserConnection::OnAnswered(error_code error) {
  if (error || closed_) return Close();
  if (!keep_alive_) return LingerThenClose();
  ReadRequest();
}

// Lets an answer sent before the whole request was read arrive: closing at once would reset it.
void BrowserConnection::LingerThenClose() {
  tcp_.expires_after(std::chrono::seconds(2));
  if (tls_) {
    return tls_->async_shutdown([self = shared_from_this()](error_code) { self->Close(); });
  }
  error_code ignored;
  tcp_.socket().shutdown(net::ip::tcp::socket::shutdown_send, ignored);
  Drain();
}

void BrowserConnection::Drain() {
  tcp_.async_read_some(net::buffer(drain_),
                       [self = shared_from_this()](error_code error, std::size_t) {
                         if (error) return self->Close();
                         self->Drain();
                       });
}

}  // namespace saccade
