#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/gateway/grpc_web.hpp"

namespace grpc {
class Channel;
}

namespace saccade {

/// Tells the services behind an in-process channel whose call it is: the browser's address without
/// its port. Only there is it to be believed.
inline constexpr char kPeerMetadata[] = "x-saccade-peer";

/// One RPC to forward: any method, its one request message still encoded.
struct CallRequest {
  std::string method;  // "/saccade.v1.SessionService/Join"
  std::string message;
  Metadata metadata;
  std::optional<std::chrono::nanoseconds> timeout;
};

/// A unary or server-streaming call through `grpc::GenericStub`, one message at a time.
///
/// All functions and handlers run on the gateway's thread: `post` brings what gRPC's threads report
/// there, and keeps that thread running until the call has ended. No message is read before
/// `ReadNext`. `on_done` comes last and exactly once, also after `Cancel`.
class UpstreamCall {
 public:
  using Post = std::function<void(std::function<void()>)>;
  struct Handlers {
    std::function<void(std::string message)> on_message;
    std::function<void(CallResult result)> on_done;
  };

  /// Starts the call and asks for its first message.
  static std::shared_ptr<UpstreamCall> Start(const std::shared_ptr<grpc::Channel>& channel,
                                             CallRequest request, Post post, Handlers handlers);
  virtual ~UpstreamCall() = default;

  /// Asks for the next message, once after each `on_message`.
  virtual void ReadNext() = 0;
  /// The browser is gone: ends the call with CANCELLED.
  virtual void Cancel() = 0;
};

}  // namespace saccade
