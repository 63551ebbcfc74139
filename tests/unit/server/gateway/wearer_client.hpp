#pragma once

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <chrono>
#include <optional>
#include <string>
#include <type_traits>

#include "saccade/v1/wearer.pb.h"

namespace saccade {

using PlainStream = boost::beast::tcp_stream;
using EncryptedStream = boost::asio::ssl::stream<boost::beast::tcp_stream>;

/// A phone's end of the socket. One thread; nothing waits for more than five seconds.
template <class Stream = PlainStream>
class WearerClient {
 public:
  explicit WearerClient(int port) : socket_(Make()) {
    namespace beast = boost::beast;
    beast::get_lowest_layer(socket_).expires_after(std::chrono::seconds(5));
    beast::get_lowest_layer(socket_).connect(boost::asio::ip::tcp::endpoint(
        boost::asio::ip::make_address("127.0.0.1"), static_cast<unsigned short>(port)));
    if constexpr (std::is_same_v<Stream, EncryptedStream>) {
      socket_.next_layer().handshake(boost::asio::ssl::stream_base::client);
    }
    port_ = port;
  }

  /// True if it became a WebSocket.
  bool Upgrade(const std::string& origin) {
    namespace websocket = boost::beast::websocket;
    socket_.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
      request.set(boost::beast::http::field::origin, origin);
    }));
    boost::system::error_code error;
    socket_.handshake("127.0.0.1:" + std::to_string(port_), "/wear/upstream", error);
    boost::beast::get_lowest_layer(socket_).expires_never();
    socket_.binary(true);
    return !error;
  }

  bool Send(const v1::WearerUpstream& message) { return SendBytes(message.SerializeAsString()); }
  bool SendBytes(const std::string& bytes) {
    boost::system::error_code error;
    socket_.write(boost::asio::buffer(bytes), error);
    return !error;
  }
  bool Hello(const std::string& token, const std::string& phone_id = "phone-1") {
    v1::WearerUpstream message;
    message.mutable_hello()->set_token(token);
    message.mutable_hello()->set_phone_id(phone_id);
    message.mutable_hello()->set_camera_label("back camera");
    return Send(message);
  }

  /// The next message; nothing if the socket ended, or after `limit`.
  std::optional<v1::WearerDownstream> Read(
      std::chrono::milliseconds limit = std::chrono::milliseconds(5000)) {
    if (!reading_ && !ended_) {
      reading_ = true;
      socket_.async_read(buffer_, [this](boost::system::error_code error, std::size_t) {
        reading_ = false;
        ended_ = static_cast<bool>(error);
        has_ = !error;
      });
    }
    io_.restart();
    const auto end = std::chrono::steady_clock::now() + limit;
    while (reading_ && std::chrono::steady_clock::now() < end) {
      io_.run_one_for(std::chrono::milliseconds(20));
      io_.restart();
    }
    if (!has_) return std::nullopt;
    has_ = false;
    v1::WearerDownstream message;
    const auto data = buffer_.cdata();
    if (!message.ParseFromArray(data.data(), static_cast<int>(data.size()))) return std::nullopt;
    buffer_.consume(buffer_.size());
    return message;
  }
  /// The next one of that kind.
  std::optional<v1::WearerDownstream> Await(v1::WearerDownstream::MessageCase kind) {
    for (int i = 0; i < 1000; ++i) {
      auto message = Read();
      if (!message || message->message_case() == kind) return message;
    }
    return std::nullopt;
  }
  /// True once the server has ended the socket.
  bool Ended(std::chrono::milliseconds limit = std::chrono::milliseconds(5000)) {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (!ended_ && std::chrono::steady_clock::now() < end) Read(std::chrono::milliseconds(50));
    return ended_;
  }
  int close_code() const { return socket_.reason().code; }

 private:
  boost::beast::websocket::stream<Stream> Make() {
    if constexpr (std::is_same_v<Stream, EncryptedStream>) {
      return boost::beast::websocket::stream<Stream>(io_, tls_);
    } else {
      return boost::beast::websocket::stream<Stream>(io_);
    }
  }

  boost::asio::io_context io_{1};
  boost::asio::ssl::context tls_{boost::asio::ssl::context::tls_client};
  boost::beast::websocket::stream<Stream> socket_;
  boost::beast::flat_buffer buffer_;
  int port_ = 0;
  bool reading_ = false, ended_ = false, has_ = false;
};

}  // namespace saccade
