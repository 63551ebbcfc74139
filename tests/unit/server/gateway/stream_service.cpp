#include "stream_service.hpp"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include <sstream>
#include <string>
#include <vector>

namespace saccade {
namespace {

std::string ToString(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string text;
  (void)buffer.Dump(&slices);
  for (const grpc::Slice& slice : slices) {
    text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return text;
}

class Reactor final : public grpc::ServerGenericBidiReactor {
 public:
  Reactor(StreamService& service, grpc::GenericCallbackServerContext* context)
      : service_(service), context_(context), method_(context->method()) {
    ++service_.open_calls;
    StartRead(&request_);
  }

  void OnReadDone(bool ok) override {
    if (!ok) return Finish(grpc::Status(grpc::StatusCode::INTERNAL, "no request"));
    const std::string text = ToString(request_);
    if (method_ == "/test.v1.Test/Echo") {
      context_->AddTrailingMetadata("x-trailer", "kept");
      total_ = 1;
      payload_ = text;
      Next();
    } else if (method_ == "/test.v1.Test/Count") {
      std::istringstream(text) >> total_ >> size_;
      Next();
    } else if (method_ == "/test.v1.Test/Fail") {
      Finish(grpc::Status(grpc::StatusCode::FAILED_PRECONDITION, "no map yet\n100 %"));
    }
    // Silent: waits for OnCancel.
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return Finish(grpc::Status::CANCELLED);
    ++service_.messages_written;
    Next();
  }

  void OnCancel() override {
    ++service_.cancelled_calls;
    if (method_ == "/test.v1.Test/Silent") Finish(grpc::Status::CANCELLED);
  }

  void OnDone() override {
    --service_.open_calls;
    delete this;
  }

 private:
  void Next() {
    if (sent_ == total_) return Finish(grpc::Status::OK);
    std::string message = payload_;
    if (message.empty()) {
      message = std::to_string(sent_);
      message.resize(std::max(message.size(), size_), ' ');
    }
    ++sent_;
    const grpc::Slice slice(message);
    response_ = grpc::ByteBuffer(&slice, 1);
    StartWrite(&response_);
  }

  StreamService& service_;
  grpc::GenericCallbackServerContext* context_;
  std::string method_;
  std::string payload_;
  int total_ = 0;
  int sent_ = 0;
  std::size_t size_ = 0;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
};

}  // namespace

struct StreamService::Impl : grpc::CallbackGenericService {
  explicit Impl(StreamService& owner) : service(owner) {}
  grpc::ServerGenericBidiReactor* CreateReactor(
      grpc::GenericCallbackServerContext* context) override {
    return new Reactor(service, context);
  }
  StreamService& service;
  std::unique_ptr<grpc::Server> server;
};

StreamService::StreamService() : impl_(std::make_unique<Impl>(*this)) {
  grpc::ServerBuilder builder;
  builder.RegisterCallbackGenericService(impl_.get());
  impl_->server = builder.BuildAndStart();
}

StreamService::~StreamService() { impl_->server->Shutdown(std::chrono::system_clock::now()); }

std::shared_ptr<grpc::Channel> StreamService::channel() const {
  return impl_->server->InProcessChannel(grpc::ChannelArguments());
}

}  // namespace saccade
