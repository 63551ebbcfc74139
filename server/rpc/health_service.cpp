#include "server/rpc/health_service.hpp"

#include <algorithm>

#include "server/rpc/early_handler.hpp"
#include "server/rpc/unary_call.hpp"

namespace saccade {
namespace {

using grpc::health::v1::HealthCheckResponse;

constexpr std::size_t kMaxWatchers = 64;  // of all together: one a load balancer
constexpr std::size_t kMaxWatchersOfAccess = 4;

bool IsServed(const std::string& service) {
  return service.empty() || service == "grpc.health.v1.Health" ||
         service.rfind("saccade.v1.", 0) == 0;
}

}  // namespace

/// One Watch: its answer, and then nothing until it ends.
class HealthService::Watcher final : public grpc::ServerWriteReactor<HealthCheckResponse> {
 public:
  explicit Watcher(HealthService& service) : service_(service) {}
  std::string access_id;  // of those that may; empty: it was refused, or needs none
  void Begin(bool served) {
    response_.set_status(served ? HealthCheckResponse::SERVING
                                : HealthCheckResponse::SERVICE_UNKNOWN);
    StartWrite(&response_);
  }
  /// The first word counts.
  void End(const grpc::Status& status) {
    if (!ended_.exchange(true)) Finish(status);
  }

 private:
  void OnWriteDone(bool ok) override {
    if (!ok) End(grpc::Status::CANCELLED);
  }
  void OnCancel() override { End(grpc::Status::CANCELLED); }
  void OnDone() override {
    service_.Forget(this);
    delete this;
  }

  HealthService& service_;
  HealthCheckResponse response_;
  std::atomic<bool> ended_ = false;
};

HealthService::HealthService(Gatekeeper& gate) : gate_(gate) {
  MarkMethodCallback(0, Early(gate, "Health/Check", this, &HealthService::Check));
}

grpc::ServerUnaryReactor* HealthService::Check(grpc::CallbackServerContext* context,
                                               const Request* request, Response* response) {
  UnaryCall call(*context, "Health/Check", UnaryCall::Log::kNothing);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  if (!IsServed(request->service())) {
    return call.Finish(absl::NotFoundError("service: there is none of this name here"));
  }
  response->set_status(HealthCheckResponse::SERVING);
  return call.Finish(absl::OkStatus());
}

grpc::ServerWriteReactor<HealthCheckResponse>* HealthService::Watch(
    grpc::CallbackServerContext* context, const Request* request) {
  auto* watcher = new Watcher(*this);
  absl::Status status = gate_.Arrive(*context, request->ByteSizeLong());
  if (status.ok()) {
    const absl::StatusOr<Access> access = gate_.Enter(*context, "Health/Watch", Toll::kRead);
    status = access.status();
    if (access.ok()) watcher->access_id = access->id;
  }
  const std::lock_guard guard(mutex_);
  if (status.ok() && stopped_) status = absl::UnavailableError("the server is shutting down");
  if (status.ok() && watchers_.size() >= kMaxWatchers) {
    status = absl::ResourceExhaustedError("health: 64 watch already, as many as may; call Check");
  }
  const auto own = [watcher](const Watcher* one) {
    return !watcher->access_id.empty() && one->access_id == watcher->access_id;
  };
  if (status.ok() && std::count_if(watchers_.begin(), watchers_.end(), own) >=
                         static_cast<std::ptrdiff_t>(kMaxWatchersOfAccess)) {
    status = absl::ResourceExhaustedError("health: you watch four times already; call Check");
  }
  if (!status.ok()) watcher->access_id.clear();
  watchers_.push_back(watcher);
  if (status.ok()) {
    watcher->Begin(IsServed(request->service()));
  } else {
    watcher->End(ToGrpc(status));
  }
  return watcher;
}

void HealthService::Stop() {
  const std::lock_guard guard(mutex_);
  stopped_ = true;
  const grpc::Status why(grpc::StatusCode::UNAVAILABLE, "the server is shutting down");
  for (Watcher* watcher : watchers_) watcher->End(why);
}

void HealthService::End(const std::vector<std::string>& access_ids, const absl::Status& why) {
  const std::lock_guard guard(mutex_);
  for (Watcher* watcher : watchers_) {
    const bool theirs =
        std::find(access_ids.begin(), access_ids.end(), watcher->access_id) != access_ids.end();
    if (theirs && !watcher->access_id.empty()) watcher->End(ToGrpc(why));
  }
}

void HealthService::Forget(Watcher* watcher) {
  const std::lock_guard guard(mutex_);
  std::erase(watchers_, watcher);
}

}  // namespace saccade
