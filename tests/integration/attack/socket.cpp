#include "tests/integration/attack/socket.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace saccade::testing {
namespace {

milliseconds LeftUntil(Clock::time_point end) {
  return std::max(milliseconds(0), std::chrono::duration_cast<milliseconds>(end - Clock::now()));
}

bool WaitFor(int fd, short events, milliseconds limit) {
  pollfd poller{fd, events, 0};
  return poll(&poller, 1, static_cast<int>(limit.count())) > 0;
}

}  // namespace

Socket::Socket(int port, int receive_buffer_bytes) {
  fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0) return;
  if (receive_buffer_bytes > 0) {
    setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) return;
  int error = errno;
  if (error == EINPROGRESS && WaitFor(fd_, POLLOUT, seconds(1))) {
    socklen_t size = sizeof error;
    getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size);
  }
  if (error != 0) Close();
}

Socket& Socket::operator=(Socket&& other) noexcept {
  Close();
  fd_ = std::exchange(other.fd_, -1);
  return *this;
}

void Socket::Close() {
  if (fd_ >= 0) close(std::exchange(fd_, -1));
}

std::size_t Socket::Send(std::string_view bytes, milliseconds limit) {
  const auto end = Clock::now() + limit;
  std::size_t sent = 0;
  while (ok() && sent < bytes.size()) {
    const ssize_t count = send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count > 0) {
      sent += static_cast<std::size_t>(count);
    } else if (errno != EAGAIN || !WaitFor(fd_, POLLOUT, LeftUntil(end))) {
      break;
    }
  }
  return sent;
}

std::string Socket::Receive(milliseconds limit, std::string_view until, std::size_t max_bytes) {
  const auto end = Clock::now() + limit;
  std::string received;
  while (ok() && received.size() < max_bytes) {
    char buffer[16384];
    const std::size_t wanted = std::min(sizeof buffer, max_bytes - received.size());
    const ssize_t count = recv(fd_, buffer, wanted, 0);
    if (count > 0) {
      received.append(buffer, static_cast<std::size_t>(count));
      if (!until.empty() && received.find(until) != std::string::npos) break;
    } else if (count == 0 || errno != EAGAIN || !WaitFor(fd_, POLLIN, LeftUntil(end))) {
      break;
    }
  }
  return received;
}

bool Socket::ClosedByPeer(milliseconds limit) {
  const auto end = Clock::now() + limit;
  while (ok()) {
    char buffer[16384];
    const ssize_t count = recv(fd_, buffer, sizeof buffer, 0);
    if (count == 0 || (count < 0 && errno != EAGAIN)) return true;
    if (count < 0 && !WaitFor(fd_, POLLIN, LeftUntil(end))) return false;
    if (Clock::now() >= end) return false;
  }
  return true;
}

std::string HttpHead(int port, const std::string& method, const std::string& path,
                     const std::string& headers) {
  return method + " " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" +
         headers + "\r\n";
}

std::string GrpcWebFrame(const std::string& payload, char flags) {
  std::string frame(1, flags);
  for (int shift = 24; shift >= 0; shift -= 8) {
    frame += static_cast<char>(payload.size() >> shift);
  }
  return frame + payload;
}

std::string GrpcWebCall(int port, const std::string& method, const std::string& payload,
                        const std::string& headers) {
  const std::string body = GrpcWebFrame(payload);
  return HttpHead(port, "POST", method,
                  "Content-Type: application/grpc-web\r\nContent-Length: " +
                      std::to_string(body.size()) + "\r\n" + headers) +
         body;
}

std::string AnswerTo(int port, const std::string& bytes, milliseconds limit) {
  Socket socket(port);
  if (!socket.ok()) return "refused";
  socket.Send(bytes, limit);
  const std::string answer = socket.Receive(limit, "\r\n");
  if (answer.empty()) return socket.ClosedByPeer(milliseconds(0)) ? "closed" : "silent";
  const std::size_t space = answer.find(' ');
  return space == std::string::npos ? "rubbish" : answer.substr(space + 1, 3);
}

}  // namespace saccade::testing
