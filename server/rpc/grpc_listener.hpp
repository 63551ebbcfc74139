#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/server_builder.h>

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/pipeline/connection_limits.hpp"

namespace saccade {

/// Accepts connections for a gRPC server.
///
/// gRPC 1.51 closes its listening port for good the first time that accept fails for want of
/// descriptors. This one waits and goes on, and turns connections away before the last descriptors
/// are gone, as well as who has too many, or comes too often (ConnectionLimits).
///
/// Who is connected it knows without gRPC's help, which owns each descriptor from then on and says
/// nothing when it closes it: a descriptor that is not that socket any more has been closed.
class GrpcListener {
 public:
  using Acceptor = grpc::experimental::ExternalConnectionAcceptor;

  /// Binds; nobody is accepted before Start. `host` is an IP literal or a name, `port` 0 any free
  /// one. Unavailable: cannot be bound, with the system's reason.
  static absl::StatusOr<std::unique_ptr<GrpcListener>> Bind(const std::string& host, int port,
                                                            const ConnectionLimits& limits = {});
  ~GrpcListener();

  int port() const { return port_; }
  /// Hands each connection to `acceptor`, on a thread of its own, until Stop.
  void Start(std::unique_ptr<Acceptor> acceptor);
  /// Closes the port. Before the gRPC server's Shutdown. May be called twice.
  void Stop();

 private:
  struct Open {
    int fd = -1;
    std::uint64_t socket = 0;  // the system's number of it, never given twice
    std::string peer;
    Timestamp accepted_ns = 0;
  };
  GrpcListener(int socket, int wake, int port, const ConnectionLimits& limits)
      : socket_(socket), wake_(wake), port_(port), limits_(limits), gate_(limits) {}
  void Run();
  bool AcceptOne();
  bool Welcome(int fd, const std::string& caller, const std::string& peer);
  ConnectionCounts Count(const std::string& peer, Timestamp now_ns);

  const int socket_;
  const int wake_;  // readable: Stop was called
  const int port_;
  const ConnectionLimits limits_;
  ConnectionGate gate_;
  std::vector<Open> open_;  // of the thread
  Timestamp said_ns_ = 0;
  std::unique_ptr<Acceptor> acceptor_;
  std::jthread thread_;
};

}  // namespace saccade
