#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

namespace saccade::testing {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// A TCP connection to 127.0.0.1 that sends whatever it is told. Closed when it goes.
class Socket {
 public:
  Socket() = default;
  /// Not ok() where nobody takes the connection. `receive_buffer_bytes` 0: the system's choice.
  explicit Socket(int port, int receive_buffer_bytes = 0);
  ~Socket() { Close(); }
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket& operator=(Socket&& other) noexcept;

  bool ok() const { return fd_ >= 0; }
  int fd() const { return fd_; }
  void Close();

  /// How much was taken before the peer closed or `limit` passed.
  std::size_t Send(std::string_view bytes, milliseconds limit = seconds(2));
  /// What came until the peer closed, `until` was seen, `limit` passed or `max_bytes` were there.
  std::string Receive(milliseconds limit, std::string_view until = {},
                      std::size_t max_bytes = 1u << 20);
  /// True as soon as the peer has closed; what it sent before is thrown away.
  bool ClosedByPeer(milliseconds limit);

 private:
  int fd_ = -1;
};

/// Request line and Host; `headers` are lines that end with \r\n.
std::string HttpHead(int port, const std::string& method, const std::string& path,
                     const std::string& headers = "");
/// One gRPC-Web frame: flags, length, payload.
std::string GrpcWebFrame(const std::string& payload, char flags = 0);
/// A whole gRPC-Web request, as a browser sends it.
std::string GrpcWebCall(int port, const std::string& method, const std::string& payload,
                        const std::string& headers = "");
/// The status code of the first line ("200"), "closed", or "silent" where nothing came in time.
std::string AnswerTo(int port, const std::string& bytes, milliseconds limit = seconds(2));

}  // namespace saccade::testing
