#pragma once

#include <array>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "server/gateway/http_connection.hpp"
#include "server/gateway/http_request_reader.hpp"
#include "server/gateway/wearer_socket.hpp"
#include "shared/io/log.hpp"

namespace saccade {

inline absl::string_view View(boost::beast::string_view text) { return {text.data(), text.size()}; }

/// What HttpConnection::Start makes; its own header only because it has several files:
/// http_connection.cpp (TLS, requests), http_answers.cpp (files, refusals), http_calls.cpp
/// (gRPC-Web).
class BrowserConnection final : public HttpConnection,
                                public std::enable_shared_from_this<BrowserConnection> {
 public:
  BrowserConnection(boost::asio::ip::tcp::socket socket, const HttpContext& context,
                    std::function<void(HttpConnection*)> on_closed)
      : tcp_(std::move(socket)), context_(context), on_closed_(std::move(on_closed)) {}
  ~BrowserConnection() override { on_closed_(this); }
  void Begin(std::string peer);
  void Close() override;
  std::optional<std::chrono::steady_clock::time_point> idle_since() const override;
  bool heard() const override { return heard_; }
  const std::string& peer() const override { return peer_; }

 private:
  using error_code = boost::system::error_code;
  using Request = HttpRequestReader::Request;

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
  void AwaitHandshake();
  void Greet();

  template <class Buffers, class Handler>
  void ReadSome(const Buffers& buffers, Handler handler) {
    if (tls_) return tls_->async_read_some(buffers, std::move(handler));
    tcp_.async_read_some(buffers, std::move(handler));
  }
  bool AnsweredInPlain();  // true: it was answered
  void ReadRequest();
  void ReadMore();
  void TakeRequest();
  bool Admitted();  // false: it was answered
  void OnRequest();
  void BecomeWearerSocket();

  // --- Files ------------------------------------------------------------------------------------
  template <class Body>
  void SetCommonHeaders(boost::beast::http::response<Body>& response) {
    response.keep_alive(keep_alive_);
    if (!retry_after_s_.empty()) response.set("Retry-After", retry_after_s_);
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Referrer-Policy", "no-referrer");
    response.set("Cross-Origin-Opener-Policy", "same-origin");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
  }
  void ServeFile();
  void Refuse(boost::beast::http::status status, absl::string_view reason,
              const std::string& location = "");
  void RefuseAndClose(boost::beast::http::status status, absl::string_view reason);
  void RefuseTooLarge();
  void RefuseTooMuch(const GatewayRefusal& refusal);

  template <class Body>
  void WriteWhole(std::shared_ptr<boost::beast::http::response<Body>> response) {
    tcp_.expires_after(context_.write_timeout);
    auto done = [self = shared_from_this(), response](error_code error, std::size_t) {
      self->Guarded([&] { self->OnAnswered(error); });
    };
    if (tls_) return boost::beast::http::async_write(*tls_, *response, std::move(done));
    boost::beast::http::async_write(tcp_, *response, std::move(done));
  }
  void OnAnswered(error_code error);
  void LingerThenClose();
  void Drain();

  // --- gRPC-Web ---------------------------------------------------------------------------------
  void Forward(GrpcWebFormat format);
  void Fail(GrpcWebFormat format, int code, absl::string_view reason,
            const std::string& details = "");
  void BeginAnswer(GrpcWebFormat format);
  void OnMessage(std::string reply);
  void OnDone(const CallResult& result);
  void WriteChunk(std::string payload, std::function<void()> then);
  void FinishChunks();
  std::string HeadText();
  void Write(std::function<void()> then);
  void WatchForDisconnect();
  void Watch();
  void OnWatched(error_code error, std::size_t size);

  boost::beast::tcp_stream tcp_;
  std::shared_ptr<boost::asio::ssl::context> tls_context_;  // of when it connected
  std::optional<TlsStream> tls_;                            // over tcp_; nothing: plain
  bool plain_at_tls_ = false;                               // plain HTTP where TLS is spoken
  const HttpContext& context_;
  std::function<void(HttpConnection*)> on_closed_;
  boost::beast::flat_buffer buffer_;
  std::optional<HttpRequestReader> reader_;
  std::string peer_;           // address without port
  std::string caller_;         // the same, or whom the proxy tells of: of this request
  std::string retry_after_s_;  // of the answer being made; empty: none
  bool heard_ = false;         // a whole request came
  bool admitted_ = false;      // this one
  std::optional<std::chrono::steady_clock::time_point> idle_since_;  // nothing is asked of us
  bool keep_alive_ = false;
  bool closed_ = false;
  bool answering_ = false;
  bool watching_ = false;
  GrpcWebFormat format_ = GrpcWebFormat::kBinary;
  std::optional<boost::beast::http::response<boost::beast::http::empty_body>>
      head_;         // until written
  std::string out_;  // what is being written
  std::shared_ptr<UpstreamCall> call_;
  std::array<char, 4096> drain_;
  std::array<char, 4096> watched_;
};

}  // namespace saccade
