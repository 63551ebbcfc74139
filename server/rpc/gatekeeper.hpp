#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>
#include <grpcpp/server_context.h>

#include <optional>
#include <string>

#include "server/identity/access_book.hpp"
#include "server/rpc/admission.hpp"
#include "server/rpc/session_table.hpp"

namespace saccade {

/// Who calls, without the port: "ipv4:127.0.0.1", "ipv6:2001:db8:0:1" (the first 64 bits, one
/// household), "unix". For a browser its own address, which the gateway tells.
std::string PeerOf(const grpc::CallbackServerContext& context);

/// The token that came with a call; empty if there is none.
absl::string_view TokenOf(const grpc::CallbackServerContext& context);

/// Asked at the beginning of every call: who is it, may they, and not too often. The only place
/// that compares a call with the table of roles (server/identity/role_table.hpp). Thread safe.
class Gatekeeper {
 public:
  using Context = grpc::CallbackServerContext;
  /// `method` as the table has it: "SessionService/Join". What it lacks is refused.
  using Method = absl::string_view;

  /// `access` and `sessions` outlive this.
  Gatekeeper(SessionTable& sessions, AccessBook& access, const RpcLimits& limits)
      : sessions_(sessions), access_(access), admission_(limits) {}

  /// A call that names no session; without a toll it costs nothing that could be limited.
  ///   Unauthenticated    no token, or one that is not valid (any more)
  ///   PermissionDenied   its role may not call this
  ///   ResourceExhausted  too often (with the time to try again)
  absl::StatusOr<Access> Enter(const Context& context, Method method, std::optional<Toll> toll);
  /// One that does. As Enter; InvalidArgument, NotFound: the session, or it belongs to another
  /// token; PermissionDenied: it joined as a viewer.
  absl::StatusOr<Session> Member(const Context& context, Method method, std::optional<Toll> toll,
                                 const std::string& session_id);

  SessionTable& sessions() { return sessions_; }
  /// Where what people did is kept.
  AccessBook& book() { return access_; }

 private:
  absl::StatusOr<Access> Check(const Context& context, Method method) const;
  absl::StatusOr<Session> FindSession(const Access& access, Method method,
                                      const std::string& session_id);

  SessionTable& sessions_;
  AccessBook& access_;
  Admission admission_;
};

}  // namespace saccade
