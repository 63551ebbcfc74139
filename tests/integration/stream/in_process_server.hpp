#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/app/engine.hpp"
#include "server/rpc/rpc_server.hpp"
#include "server/rpc/stream_hub.hpp"

namespace saccade::testing {

struct InProcessOptions {
  std::optional<std::uint64_t> frames;  // the source ends after so many; absent: never
  int width = 320, height = 240;
  std::filesystem::path data_dir;  // empty: nothing is stored
  std::size_t mailbox = 64;
  SessionTableOptions sessions;
  std::shared_ptr<Mount> mount;  // null: none
  /// Features that change in every frame, beside the 20 that stand still: so many a map of a desk
  /// sends anew.
  int lively_features = 0;
  /// The camera moves aside as the texture does, which then hangs at z = 2 m, and keyframes are
  /// told of.
  bool moves_aside = false;
  std::shared_ptr<SurfaceRunner> surfaces;  // null: none
  /// Runs on the tracker thread before each frame.
  std::function<void()> before_frame = [] {};
};

/// The server's engine, hub and gRPC server in this process, on a free port. The camera is a moving
/// texture at 30 Hz; the tracker is scripted: 20 features in the plane z = 2 m, camera at the
/// origin, turned by the mount if there is one, always tracking.
class InProcessServer {
 public:
  explicit InProcessServer(const InProcessOptions& options = {});
  ~InProcessServer();

  std::string address() const { return "127.0.0.1:" + std::to_string(rpc_->port()); }
  Engine& engine() { return *engine_; }
  RpcServer& rpc() { return *rpc_; }
  StreamHub& hub() { return hub_; }
  void Stop();

 private:
  StreamHub hub_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<RpcServer> rpc_;
};

}  // namespace saccade::testing
