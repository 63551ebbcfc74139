#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "saccade/v1/session.grpc.pb.h"

namespace saccade {

/// What one subscriber was sent. Nothing is decoded: tags, sequence and frame id are read from the
/// first bytes of each event, the rest is counted.
struct FanOutCounts {
  std::uint64_t events = 0, bytes = 0, pictures = 0, poses = 0, key_frames = 0;
  std::uint64_t skipped = 0;  // frames between two pictures
  std::uint64_t last_frame = 0;
  bool has_frame = false, ended = false;
};

/// Many subscribers, each with a socket of its own, on one completion queue and one thread. Every
/// eighth event is acknowledged, one request under way at a time, as page and command line do.
class FanOutClients {
 public:
  FanOutClients(const std::string& address, int count);
  ~FanOutClients();

  /// Counts from now on.
  void Reset();
  std::vector<FanOutCounts> counts() const;

 private:
  class Client;
  void Run();

  grpc::CompletionQueue queue_;
  std::vector<std::unique_ptr<Client>> clients_;
  mutable std::mutex mutex_;
  bool leaving_ = false;
  std::thread thread_;
};

}  // namespace saccade
