#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/server_builder.h>

#include <memory>
#include <string>
#include <thread>

namespace saccade {

/// Accepts connections for a gRPC server.
///
/// gRPC 1.51 closes its listening port for good the first time that accept fails for want of
/// descriptors. This one waits and goes on, and turns connections away before the last descriptors
/// are gone.
class GrpcListener {
 public:
  using Acceptor = grpc::experimental::ExternalConnectionAcceptor;

  /// Binds; nobody is accepted before Start. `host` is an IP literal or a name, `port` 0 any free
  /// one. Unavailable: cannot be bound, with the system's reason.
  static absl::StatusOr<std::unique_ptr<GrpcListener>> Bind(const std::string& host, int port);
  ~GrpcListener();

  int port() const { return port_; }
  /// Hands each connection to `acceptor`, on a thread of its own, until Stop.
  void Start(std::unique_ptr<Acceptor> acceptor);
  /// Closes the port. Before the gRPC server's Shutdown. May be called twice.
  void Stop();

 private:
  GrpcListener(int socket, int wake, int port) : socket_(socket), wake_(wake), port_(port) {}
  void Run();
  bool AcceptOne();

  const int socket_;
  const int wake_;  // readable: Stop was called
  const int port_;
  std::unique_ptr<Acceptor> acceptor_;
  std::jthread thread_;
};

}  // namespace saccade
