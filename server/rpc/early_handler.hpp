#pragma once

#include <absl/strings/str_cat.h>
#include <grpc/byte_buffer.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <utility>

#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/status.hpp"

namespace saccade {

/// Of a method's request [bytes]: pictures are large, nothing else is.
inline std::size_t LargestRequest(absl::string_view method) {
  return method == "AnnotationService/Create" ? 1280 * 1024 : 256 * 1024;
}

/// Asks Gatekeeper::Arrive before the message of a unary call is parsed, which gRPC's own handler
/// does before anybody is asked. Who is refused costs a look at two buckets and an answer.
///
/// Goes round what generated code makes (grpc::internal::CallbackUnaryHandler), whose form belongs
/// to the generator's contract with the library: both come from one Debian package.
template <class Request, class Response>
class EarlyHandler final : public grpc::internal::MethodHandler {
 public:
  using Inner = grpc::internal::CallbackUnaryHandler<Request, Response>;
  using Serve = std::function<grpc::ServerUnaryReactor*(grpc::CallbackServerContext*,
                                                        const Request*, Response*)>;

  EarlyHandler(Gatekeeper& gate, const char* method, Serve serve)
      : gate_(gate), method_(method), serve_(std::move(serve)), refuse_(Refuse) {}

  // The bytes as they came: whether they are worth parsing is known once there is a context.
  void* Deserialize(grpc_call* /*call*/, grpc_byte_buffer* bytes, grpc::Status* /*status*/,
                    void** kept) override {
    *kept = bytes;
    return nullptr;
  }

  void RunHandler(const HandlerParameter& parameter) override {
    auto* bytes = static_cast<grpc_byte_buffer*>(parameter.internal_data);
    const auto& context = *static_cast<grpc::CallbackServerContext*>(parameter.server_context);
    const std::size_t size = bytes == nullptr ? 0 : grpc_byte_buffer_length(bytes);
    absl::Status early = gate_.Arrive(context, size);
    if (early.ok() && size > LargestRequest(method_)) {
      early = absl::ResourceExhaustedError(
          absl::StrCat("request: ", size, " bytes are more than ", LargestRequest(method_)));
    }
    if (!early.ok()) {
      if (bytes != nullptr) grpc_byte_buffer_destroy(bytes);
      bytes = grpc_raw_byte_buffer_create(nullptr, 0);
      Audit(method_, "", early);
      refusal = ToGrpc(early);
    }
    Inner& inner = early.ok() ? serve_ : refuse_;
    grpc::Status status;
    void* holder = nullptr;
    void* request = inner.Deserialize(parameter.call->call(), bytes, &status, &holder);
    inner.RunHandler(HandlerParameter(parameter.call, parameter.server_context, request, status,
                                      holder, parameter.call_requester));
  }

 private:
  static grpc::ServerUnaryReactor* Refuse(grpc::CallbackServerContext* context, const Request*,
                                          Response*) {
    auto* reactor = context->DefaultReactor();
    reactor->Finish(refusal);
    return reactor;
  }

  static inline thread_local grpc::Status refusal;  // from RunHandler to Refuse, which it calls

  Gatekeeper& gate_;
  const char* const method_;
  Inner serve_, refuse_;
};

/// Which method of a service an EarlyHandler stands before: its row in the table of roles
/// ("AccessService/Redeem"), and what serves it.
template <class Service, class Request, class Response>
grpc::internal::MethodHandler* Early(Gatekeeper& gate, const char* method, Service* service,
                                     grpc::ServerUnaryReactor* (Service::*serve)(
                                         grpc::CallbackServerContext*, const Request*, Response*)) {
  return new EarlyHandler<Request, Response>(
      gate, method,
      [service, serve](grpc::CallbackServerContext* context, const Request* request,
                       Response* response) {
        return (service->*serve)(context, request, response);
      });
}

}  // namespace saccade
