#include "server/rpc/grpc_listener.hpp"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "server/pipeline/descriptors.hpp"

namespace saccade {
namespace {

constexpr int kBacklog = 512;
constexpr int kRetryMs = 100;

int PortOf(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  if (address.ss_family == AF_INET6) {
    return ntohs(reinterpret_cast<const sockaddr_in6&>(address).sin6_port);
  }
  return ntohs(reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

/// A listening socket, or -1 with errno.
int ListenAt(const addrinfo& address) {
  const int socket = ::socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket < 0) return -1;
  const int on = 1;
  (void)::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  if (::bind(socket, address.ai_addr, address.ai_addrlen) == 0 && ::listen(socket, kBacklog) == 0) {
    return socket;
  }
  const int why = errno;
  ::close(socket);
  errno = why;
  return -1;
}

}  // namespace

absl::StatusOr<std::unique_ptr<GrpcListener>> GrpcListener::Bind(const std::string& host,
                                                                 int port) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int unknown = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
  if (unknown != 0) return absl::UnavailableError(absl::StrCat(host, ": ", gai_strerror(unknown)));
  const absl::Cleanup free = [found] { ::freeaddrinfo(found); };
  const int socket = ListenAt(*found);
  if (socket < 0) return absl::UnavailableError(std::strerror(errno));
  const int wake = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake < 0) {
    ::close(socket);
    return absl::UnavailableError(std::strerror(errno));
  }
  return std::unique_ptr<GrpcListener>(new GrpcListener(socket, wake, PortOf(socket)));
}

GrpcListener::~GrpcListener() {
  Stop();
  ::close(socket_);
  ::close(wake_);
}

void GrpcListener::Start(std::unique_ptr<Acceptor> acceptor) {
  acceptor_ = std::move(acceptor);
  thread_ = std::jthread([this] { Run(); });
}

void GrpcListener::Stop() {
  if (!thread_.joinable()) return;
  const std::uint64_t one = 1;
  (void)!::write(wake_, &one, sizeof(one));
  thread_.join();
  ::shutdown(socket_, SHUT_RDWR);  // who waits to be accepted is told
}

// False: nothing to accept now, or no means to.
bool GrpcListener::AcceptOne() {
  const int fd = ::accept4(socket_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0) return errno == EINTR || errno == ECONNABORTED;
  if (DescriptorsRunOut(fd)) {
    ::close(fd);
    return true;
  }
  const int on = 1;
  (void)::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  NoticeDeadPeer(fd);
  Acceptor::NewConnectionParameters connection;
  connection.listener_fd = socket_;
  connection.fd = fd;
  acceptor_->HandleNewConnection(&connection);
  return true;
}

void GrpcListener::Run() {
  for (;;) {
    pollfd ends[2] = {{socket_, POLLIN, 0}, {wake_, POLLIN, 0}};
    if (::poll(ends, 2, -1) < 0 && errno != EINTR) return;
    if (ends[1].revents != 0) return;
    if ((ends[0].revents & POLLIN) == 0) continue;
    while (AcceptOne()) {
    }
    // Out of descriptors: the socket stays readable, so wait instead of spinning.
    if (errno != EAGAIN && errno != EWOULDBLOCK && ::poll(&ends[1], 1, kRetryMs) > 0) return;
  }
}

}  // namespace saccade
