#include "tests/integration/identity/https_client.hpp"

#include <absl/strings/escaping.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <openssl/ssl.h>

#include <string_view>

#include "tests/integration/identity/tls_socket.hpp"

namespace saccade::testing {
namespace {

// Chunks as far as they came, joined.
std::string Joined(std::string_view chunks) {
  std::string body;
  for (;;) {
    const std::size_t line = chunks.find("\r\n");
    std::uint32_t size = 0;
    if (line == std::string_view::npos ||
        !absl::SimpleHexAtoi(absl::string_view(chunks.data(), line), &size)) {
      return body;
    }
    chunks.remove_prefix(line + 2);
    if (size == 0 || chunks.size() < size + 2) return body;
    body.append(chunks.substr(0, size));
    chunks.remove_prefix(size + 2);
  }
}

std::string Unescaped(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%' || i + 2 >= text.size()) {
      out += text[i];
      continue;
    }
    out += absl::HexStringToBytes(text.substr(i + 1, 2));
    i += 2;
  }
  return out;
}

// Frames of gRPC-Web: messages, then trailers.
void ReadFrames(HttpsReply& reply) {
  std::string_view left = reply.body;
  while (left.size() >= 5) {
    const auto byte = [&left](int at) {
      return static_cast<std::uint32_t>(
          static_cast<unsigned char>(left[static_cast<std::size_t>(at)]));
    };
    const std::size_t size = byte(1) << 24 | byte(2) << 16 | byte(3) << 8 | byte(4);
    const bool trailers = byte(0) == 0x80;
    if (left.size() < 5 + size) return;
    const std::string payload(left.substr(5, size));
    left.remove_prefix(5 + size);
    if (!trailers) {
      reply.message = true;
      continue;
    }
    const auto value = [&payload](const std::string& name) -> std::string {
      const std::size_t at = payload.find(name);
      if (at == std::string::npos) return "";
      const std::size_t begin = at + name.size();
      return payload.substr(begin, payload.find("\r\n", begin) - begin);
    };
    (void)absl::SimpleAtoi(value("grpc-status:"), &reply.grpc_status);
    reply.grpc_message = Unescaped(value("grpc-message:"));
    if (absl::StartsWith(reply.grpc_message, " ")) reply.grpc_message.erase(0, 1);
  }
}

std::string TextOf(const HttpsRequest& request) {
  const std::string host =
      request.host.empty() ? absl::StrCat("127.0.0.1:", request.port) : request.host;
  std::string text = absl::StrCat(request.method, " ", request.target, " HTTP/1.1\r\nHost: ", host,
                                  "\r\nConnection: close\r\n");
  if (!request.origin.empty()) absl::StrAppend(&text, "Origin: ", request.origin, "\r\n");
  if (!request.token.empty()) {
    absl::StrAppend(&text, "Authorization: Bearer ", request.token, "\r\n");
  }
  if (!request.content_type.empty()) {
    absl::StrAppend(&text, "Content-Type: ", request.content_type, "\r\n");
  }
  if (request.method == "POST") {
    absl::StrAppend(&text, "Content-Length: ", request.body.size(), "\r\n");
  }
  return absl::StrCat(text, request.headers, "\r\n", request.body);
}

}  // namespace

HttpsReply Send(const HttpsRequest& request) {
  HttpsReply reply;
  TlsSocket connection(request.port, request.root_pem, TLS1_3_VERSION, TLS1_3_VERSION);
  if (!connection.verified() || !connection.Write(TextOf(request))) return reply;
  const auto end = std::chrono::steady_clock::now() + request.patience;
  std::string all, piece;
  while (std::chrono::steady_clock::now() < end && connection.Read(piece)) {
    all += piece;
    const std::size_t head = all.find("\r\n\r\n");
    if (head == std::string::npos) continue;
    reply.head = all.substr(0, head);
    const bool chunked = absl::StrContains(reply.head, "chunked");
    reply.body = chunked ? Joined(std::string_view(all).substr(head + 4)) : all.substr(head + 4);
    reply.message = false;
    if (!request.content_type.empty()) ReadFrames(reply);
    if (reply.grpc_status >= 0 || (reply.message && request.first_message_is_enough)) break;
  }
  if (reply.head.size() > 12) (void)absl::SimpleAtoi(reply.head.substr(9, 3), &reply.http_status);
  return reply;
}

HttpsReply CallOverWeb(int port, const std::string& root_pem, const std::string& method,
                       const std::string& message, const std::string& token) {
  HttpsRequest request;
  request.port = port;
  request.root_pem = root_pem;
  request.method = "POST";
  request.target = "/" + method;
  request.token = token;
  request.content_type = "application/grpc-web+proto";
  const auto size = static_cast<std::uint32_t>(message.size());
  request.body = std::string(1, '\0');
  for (int shift = 24; shift >= 0; shift -= 8) {
    request.body += static_cast<char>(size >> shift & 0xff);
  }
  request.body += message;
  return Send(request);
}

bool Handshake(int port, const std::string& root_pem, int version, bool* verified) {
  const TlsSocket connection(port, root_pem, version, version);
  if (verified != nullptr) *verified = connection.verified();
  return connection.open();
}

}  // namespace saccade::testing
