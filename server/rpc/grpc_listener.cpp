#include "server/rpc/grpc_listener.hpp"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>
#include <linux/tcp.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "server/pipeline/descriptors.hpp"
#include "server/pipeline/peer_address.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr int kBacklog = 512;
constexpr int kRetryMs = 100;
constexpr Timestamp kHandshake_ns = 10'000'000'000;  // as rpc_server.cpp limits it
constexpr Timestamp kSay_ns = 1'000'000'000;         // a line of the log at most so often

int PortOf(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  if (address.ss_family == AF_INET6) {
    return ntohs(reinterpret_cast<const sockaddr_in6&>(address).sin6_port);
  }
  return ntohs(reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

std::string AddressText(const sockaddr_storage& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const void* bytes = &reinterpret_cast<const sockaddr_in&>(address).sin_addr;
  if (address.ss_family == AF_INET6) {
    bytes = &reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
  }
  return inet_ntop(address.ss_family, bytes, text.data(), text.size()) == nullptr ? ""
                                                                                  : text.data();
}

/// 0: there is none.
std::uint64_t SocketNumber(int fd) {
  struct stat facts {};
  return ::fstat(fd, &facts) == 0 && S_ISSOCK(facts.st_mode) ? facts.st_ino : 0;
}

/// With data, as TCP counts them.
unsigned SegmentsFrom(int fd) {
  tcp_info info{};
  socklen_t size = sizeof(info);
  if (::getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return 0;
  return info.tcpi_data_segs_in;
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

absl::StatusOr<std::unique_ptr<GrpcListener>> GrpcListener::Bind(const std::string& host, int port,
                                                                 const ConnectionLimits& limits) {
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
  return std::unique_ptr<GrpcListener>(new GrpcListener(socket, wake, PortOf(socket), limits));
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
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  const int fd = ::accept4(socket_, reinterpret_cast<sockaddr*>(&address), &size,
                           SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0) return errno == EINTR || errno == ECONNABORTED;
  const std::string caller = AddressText(address);
  const std::string peer = PeerKey(caller);
  if (DescriptorsRunOut(fd) || !Welcome(fd, caller, peer)) {
    ::close(fd);
    return true;
  }
  const int on = 1;
  (void)::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  NoticeDeadPeer(fd);
  Acceptor::NewConnectionParameters connection;
  connection.listener_fd = socket_;
  connection.fd = fd;
  open_.push_back({fd, SocketNumber(fd), peer, MonotonicNow()});
  acceptor_->HandleNewConnection(&connection);
  return true;
}

bool GrpcListener::Welcome(int fd, const std::string& caller, const std::string& peer) {
  const Timestamp now_ns = MonotonicNow();
  const bool proxy = gate_.IsProxy(caller);
  absl::Status status = proxy ? absl::OkStatus() : gate_.Hurry(peer, now_ns);
  if (status.ok()) {
    std::erase_if(open_,
                  [fd](const Open& one) { return one.fd == fd; });  // the system gave it anew
    const ConnectionCounts counts = Count(peer, now_ns);
    if (!proxy) status = gate_.Admit(peer, counts);
    // Whoever fills the port must not keep out who is on the machine itself, to revoke them.
    if (status.ok() && counts.all >= limits_.all && !IsThisMachine(peer)) {
      status = absl::ResourceExhaustedError(
          absl::StrCat("connections: ", counts.all, " are open, as many as may be"));
    }
  }
  if (!status.ok() && now_ns - said_ns_ > kSay_ns) {
    said_ns_ = now_ns;
    Log(absl::StrCat("grpc: ", peer, " was turned away: ", status.message()));
  }
  return status.ok();
}

ConnectionCounts GrpcListener::Count(const std::string& peer, Timestamp now_ns) {
  std::erase_if(open_, [](const Open& one) { return SocketNumber(one.fd) != one.socket; });
  ConnectionCounts counts;
  counts.all = static_cast<int>(open_.size());
  const std::string network = NetworkKey(peer);
  for (const Open& one : open_) {
    if (NetworkKey(one.peer) == network) ++counts.of_network;
    if (one.peer != peer) continue;
    ++counts.of_address;
    // A handshake takes two messages of the caller's; who never sends them is closed by gRPC.
    const bool young = now_ns - one.accepted_ns < kHandshake_ns;
    if (young && SegmentsFrom(one.fd) < 2) ++counts.unheard_of_address;
  }
  return counts;
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
