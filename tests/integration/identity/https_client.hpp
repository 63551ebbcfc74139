#pragma once

#include <chrono>
#include <string>

namespace saccade::testing {

struct HttpsReply {
  int http_status = 0;       // 0: no answer
  int grpc_status = -1;      // of the body's trailers; -1: none came
  std::string grpc_message;  // as it was before percent encoding
  bool message = false;      // a message came before the trailers, or instead of them
  std::string head, body;
};

/// One HTTPS request on a connection of its own. Trusts `root_pem` alone, and only for 127.0.0.1.
struct HttpsRequest {
  int port = 0;
  std::string root_pem;
  std::string method = "GET", target = "/";
  std::string host, origin;  // empty: 127.0.0.1:PORT, none
  std::string token;         // empty: none
  std::string body;
  std::string content_type;
  std::string headers;  // more lines, each with \r\n
  /// Reads until the server ends the answer, at most so long; a stream's first message ends it,
  /// too.
  std::chrono::milliseconds patience{5000};
  bool first_message_is_enough = true;
};
HttpsReply Send(const HttpsRequest& request);

/// A gRPC-Web call through the gateway.
HttpsReply CallOverWeb(int port, const std::string& root_pem, const std::string& method,
                       const std::string& message, const std::string& token);

/// Whether a TLS handshake with `version` alone (TLS1_2_VERSION ...) succeeds; `verified`: with a
/// certificate that `root_pem` vouches for.
bool Handshake(int port, const std::string& root_pem, int version, bool* verified = nullptr);

}  // namespace saccade::testing
