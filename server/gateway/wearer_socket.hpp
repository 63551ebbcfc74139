#pragma once

#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <functional>
#include <memory>
#include <string>

#include "server/gateway/http_request_reader.hpp"
#include "server/pipeline/wearer_port.hpp"

namespace saccade {

using TlsStream = boost::asio::ssl::stream<boost::beast::tcp_stream&>;

/// A browser's connection that becomes a WebSocket at /wear/upstream.
struct WearerUpgrade {
  boost::beast::tcp_stream& tcp;
  TlsStream* tls;  // over tcp; null: plain
  const HttpRequestReader::Request& request;
  std::string peer;
  std::shared_ptr<void> owner;     // of all the above: kept until the end
  std::function<void()> on_ended;  // once, when the socket is of no more use
};

/// True: it asks for what StartWearerSocket does. Host and Origin are the caller's to check.
bool IsWearerUpgrade(const HttpRequestReader::Request& request);

/// Answers the upgrade and hands messages to and fro until one side ends it; all on the streams'
/// thread. A message is as long as the link allows before any of it is looked at; what the phone
/// does not take is left out; a phone that is silent for eight seconds is gone.
void StartWearerSocket(WearerUpgrade upgrade, WearerPort& port);

}  // namespace saccade
