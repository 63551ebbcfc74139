#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/server_context.h>

#include <string>

#include "server/rpc/admission.hpp"
#include "server/rpc/session_table.hpp"

namespace saccade {

/// Who calls, without the port: "ipv4:127.0.0.1", "ipv6:2001:db8:0:1" (the first 64 bits, one
/// household), "unix". For a browser its own address, which the gateway tells.
std::string PeerOf(const grpc::CallbackServerContext& context);

/// Asked at the beginning of every call: who is it, may they, and not too often. Thread safe.
class Gatekeeper {
 public:
  using Context = grpc::CallbackServerContext;
  Gatekeeper(SessionTable& sessions, const RpcLimits& limits)
      : sessions_(sessions), admission_(limits) {}

  /// ResourceExhausted: too often (with the time to try again).
  absl::Status Anyone(const Context& context, Toll toll);
  /// As Anyone; InvalidArgument, NotFound: the session.
  absl::StatusOr<Session> Member(const Context& context, Toll toll, const std::string& session_id);
  /// As Member; PermissionDenied: a viewer.
  absl::StatusOr<Session> Editor(const Context& context, Toll toll, const std::string& session_id);

  SessionTable& sessions() { return sessions_; }

 private:
  absl::StatusOr<Session> Admit(const Context& context, Toll toll, absl::StatusOr<Session> session);

  SessionTable& sessions_;
  Admission admission_;
};

}  // namespace saccade
