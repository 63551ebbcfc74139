#include "http_client.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "server/gateway/grpc_web.hpp"

namespace saccade {

HttpClient::HttpClient(int port, int receive_buffer_bytes) {
  socket_ = socket(AF_INET, SOCK_STREAM, 0);
  if (receive_buffer_bytes > 0) {
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof(receive_buffer_bytes));
  }
  const timeval timeout{10, 0};
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) Close();
}

HttpClient::~HttpClient() { Close(); }

void HttpClient::Close() {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
}

void HttpClient::Send(const std::string& bytes) const {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t n = send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return;
    sent += static_cast<std::size_t>(n);
  }
}

HttpReply HttpClient::Get(const std::string& target, const std::string& header_lines) {
  Send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + header_lines + "\r\n");
  return ReadReply();
}

void HttpClient::SendCall(const std::string& method, const std::string& message,
                          const std::string& header_lines) const {
  const std::string body = EncodeGrpcWebMessage(message, GrpcWebFormat::kBinary);
  Send("POST " + method +
       " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/grpc-web+proto\r\n"
       "Content-Length: " +
       std::to_string(body.size()) + "\r\n" + header_lines + "\r\n" + body);
}

HttpReply HttpClient::Call(const std::string& method, const std::string& message,
                           const std::string& header_lines) {
  SendCall(method, message, header_lines);
  return ReadReply();
}

bool HttpClient::Fill() {
  std::array<char, 16384> bytes;
  const ssize_t n = recv(socket_, bytes.data(), bytes.size(), 0);
  if (n <= 0) return false;
  buffer_.append(bytes.data(), static_cast<std::size_t>(n));
  return true;
}

std::string HttpClient::ReadLine() {
  std::size_t end = 0;
  while ((end = buffer_.find("\r\n")) == std::string::npos) {
    if (!Fill()) return {};
  }
  std::string line = buffer_.substr(0, end);
  buffer_.erase(0, end + 2);
  return line;
}

std::string HttpClient::ReadBytes(std::size_t size) {
  while (buffer_.size() < size) {
    if (!Fill()) break;
  }
  std::string bytes = buffer_.substr(0, size);
  buffer_.erase(0, size);
  return bytes;
}

HttpReply HttpClient::ReadReply(bool head_only) {
  HttpReply reply;
  const std::string first = ReadLine();
  if (first.size() > 12) reply.status = std::stoi(first.substr(9, 3));
  for (std::string line = ReadLine(); !line.empty(); line = ReadLine()) {
    const std::size_t colon = line.find(':');
    std::string name = line.substr(0, colon);
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    reply.headers[name] = line.substr(std::min(colon + 2, line.size()));
  }
  if (head_only || reply.status == 304) return reply;
  if (reply.headers.contains("content-length")) {
    reply.body = ReadBytes(std::stoul(reply.headers["content-length"]));
  } else {
    while (const auto chunk = ReadChunk()) reply.body += *chunk;
  }
  return reply;
}

std::optional<std::string> HttpClient::ReadChunk() {
  const std::string line = ReadLine();
  if (line.empty()) return std::nullopt;
  const std::size_t size = std::stoul(line, nullptr, 16);
  std::string chunk = ReadBytes(size);
  ReadLine();
  if (size == 0) return std::nullopt;
  return chunk;
}

bool HttpClient::ClosedWithin(std::chrono::milliseconds timeout) const {
  pollfd poll_socket{socket_, POLLIN, 0};
  if (poll(&poll_socket, 1, static_cast<int>(timeout.count())) <= 0) return false;
  char byte = 0;
  return recv(socket_, &byte, 1, MSG_PEEK) <= 0;
}

std::vector<WebFrame> SplitFrames(const std::string& body) {
  std::vector<WebFrame> frames;
  std::size_t at = 0;
  while (at + 5 <= body.size()) {
    std::size_t size = 0;
    for (std::size_t i = 1; i < 5; ++i) size = size << 8 | static_cast<unsigned char>(body[at + i]);
    frames.push_back({(body[at] & 0x80) != 0, body.substr(at + 5, size)});
    at += 5 + size;
  }
  return frames;
}

}  // namespace saccade
