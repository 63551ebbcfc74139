#include "server/gateway/upstream_call.hpp"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <utility>
#include <vector>

#include "absl/strings/match.h"

namespace saccade {
namespace {

std::string ToString(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string out;
  if (!buffer.Dump(&slices).ok()) return out;
  out.reserve(buffer.Length());
  for (const grpc::Slice& slice : slices) {
    out.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return out;
}

class GenericCall final : public UpstreamCall,
                          public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  GenericCall(const std::shared_ptr<grpc::Channel>& channel, Post post, Handlers handlers)
      : stub_(channel), post_(std::move(post)), handlers_(std::move(handlers)) {}

  void Begin(const CallRequest& request, std::shared_ptr<GenericCall> self) {
    self_ = std::move(self);
    for (const auto& [name, value] : request.metadata) context_.AddMetadata(name, value);
    if (request.timeout) {
      context_.set_deadline(
          std::chrono::system_clock::now() +
          std::chrono::duration_cast<std::chrono::system_clock::duration>(*request.timeout));
    }
    const grpc::Slice slice(request.message);
    request_ = grpc::ByteBuffer(&slice, 1);
    stub_.PrepareBidiStreamingCall(&context_, request.method, grpc::StubOptions(), this);
    // Held until the last message is with the browser: the status must not overtake it.
    AddHold();
    StartWriteLast(&request_, grpc::WriteOptions());
    reading_ = true;
    StartRead(&response_);
    handed_over_.store(true, std::memory_order_release);
    StartCall();
  }

  void ReadNext() override {
    if (reading_ || !held_) return;
    reading_ = true;
    StartRead(&response_);
  }

  void Cancel() override {
    cancelled_ = true;
    context_.TryCancel();
    if (!reading_) Release();
  }

 private:
  // From here to OnDone: gRPC's threads.
  void OnReadDone(bool ok) override {
    (void)handed_over_.load(std::memory_order_acquire);
    post_([this, ok] { Received(ok); });
  }

  void OnDone(const grpc::Status& status) override {
    (void)handed_over_.load(std::memory_order_acquire);
    CallResult result{
        static_cast<int>(status.error_code()), status.error_message(), status.error_details(), {}};
    for (const auto& [name, value] : context_.GetServerTrailingMetadata()) {
      const std::string key(name.data(), name.size());
      if (!absl::StartsWith(key, "grpc-")) {
        result.trailers.emplace_back(key, std::string(value.data(), value.size()));
      }
    }
    // Moved out first: once posted, the last reference may go at any time.
    std::shared_ptr<GenericCall> self = std::move(self_);
    const Post post = post_;
    post([self = std::move(self), result = std::move(result)]() mutable {
      const Handlers handlers = std::exchange(self->handlers_, {});
      if (handlers.on_done) handlers.on_done(std::move(result));
    });
  }

  // The gateway's thread again.
  void Received(bool ok) {
    reading_ = false;
    if (!ok || cancelled_) return Release();
    std::string message = ToString(response_);
    response_.Clear();
    if (handlers_.on_message) handlers_.on_message(std::move(message));
  }

  void Release() {
    if (!std::exchange(held_, false)) return;
    RemoveHold();
  }

  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  Post post_;
  Handlers handlers_;
  bool reading_ = false;
  bool held_ = true;
  bool cancelled_ = false;
  // gRPC's own locks order its callbacks after StartCall; this says so where they cannot be seen,
  // to a thread sanitizer beside an uninstrumented gRPC.
  std::atomic<bool> handed_over_ = false;
  std::shared_ptr<GenericCall> self_;  // until OnDone: gRPC holds a bare pointer
};

}  // namespace

std::shared_ptr<UpstreamCall> UpstreamCall::Start(const std::shared_ptr<grpc::Channel>& channel,
                                                  CallRequest request, Post post,
                                                  Handlers handlers) {
  auto call = std::make_shared<GenericCall>(channel, std::move(post), std::move(handlers));
  call->Begin(request, call);
  return call;
}

}  // namespace saccade
