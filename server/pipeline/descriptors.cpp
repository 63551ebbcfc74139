#include "server/pipeline/descriptors.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/resource.h>
#include <sys/socket.h>

namespace saccade {
namespace {

constexpr rlim_t kReserved = 64;
// More would only be memory for whoever floods.
constexpr rlim_t kEnough = 16384;

void Set(int socket, int level, int option, int value) {
  // Refused only by what is no TCP socket: then there is nothing to notice.
  (void)::setsockopt(socket, level, option, &value, sizeof(value));
}

}  // namespace

void RaiseDescriptorLimit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= kEnough) return;
  limit.rlim_cur = limit.rlim_max < kEnough ? limit.rlim_max : kEnough;
  (void)::setrlimit(RLIMIT_NOFILE, &limit);
}

bool DescriptorsRunOut(int accepted) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return false;
  if (limit.rlim_cur == RLIM_INFINITY || accepted < 0) return false;
  // A process that may have next to none keeps what it can.
  const rlim_t reserved = limit.rlim_cur / 4 < kReserved ? limit.rlim_cur / 4 : kReserved;
  return static_cast<rlim_t>(accepted) >= limit.rlim_cur - reserved;
}

void NoticeDeadPeer(int socket) {
  Set(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  Set(socket, IPPROTO_TCP, TCP_KEEPIDLE, 10);
  Set(socket, IPPROTO_TCP, TCP_KEEPINTVL, 5);
  Set(socket, IPPROTO_TCP, TCP_KEEPCNT, 3);
  Set(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, 25'000);
}

}  // namespace saccade
