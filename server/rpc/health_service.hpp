#pragma once

#include <functional>

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/rpc/gatekeeper.hpp"

namespace saccade {

/// gRPC's health protocol. Check is for load balancers, which have no token: two numbers, limited
/// like everything else. Watch holds a stream, and so takes a token where one is asked for; gRPC's
/// own service would give it to anybody, as often as they like.
///
/// A server that answers serves: it ends its streams as it stops.
class HealthService final : public grpc::health::v1::Health::CallbackService {
 public:
  explicit HealthService(Gatekeeper& gate);
  /// Ends every Watch of these passes.
  void End(const std::vector<std::string>& access_ids, const absl::Status& why);
  /// Ends every Watch, and each that comes.
  void Stop();

 private:
  class Watcher;
  using Request = grpc::health::v1::HealthCheckRequest;
  using Response = grpc::health::v1::HealthCheckResponse;

  grpc::ServerUnaryReactor* Check(grpc::CallbackServerContext* context, const Request* request,
                                  Response* response) override;
  grpc::ServerWriteReactor<Response>* Watch(grpc::CallbackServerContext* context,
                                            const Request* request) override;
  void Forget(Watcher* watcher);

  Gatekeeper& gate_;
  std::mutex mutex_;
  bool stopped_ = false;            // guarded by mutex_
  std::vector<Watcher*> watchers_;  // likewise
};

}  // namespace saccade
