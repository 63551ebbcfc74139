#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>
#include <grpcpp/server_context.h>

#include <map>
#include <optional>
#include <string>

#include "server/identity/access_book.hpp"
#include "server/rpc/admission.hpp"
#include "server/rpc/session_table.hpp"
#include "server/rpc/traffic_gate.hpp"

namespace saccade {

/// The token that came with a call; empty if there is none.
absl::string_view TokenOf(const grpc::CallbackServerContext& context);

/// What machines may do that show a certificate of tls.client_ca: by its common name, or a URI of
/// its alternative names; any other is a viewer.
using MachineRoles = std::map<std::string, AccessRole>;

/// Asked at the beginning of every call: who is it, may they, and not too often. The only place
/// that compares a call with the table of roles (server/identity/role_table.hpp). Thread safe.
class Gatekeeper {
 public:
  using Context = grpc::CallbackServerContext;
  /// `method` as the table has it: "SessionService/Join". What it lacks is refused.
  using Method = absl::string_view;

  struct Options {
    RpcLimits limits;
    TrafficLimits traffic;
    MachineRoles machines;
    std::string
        trusted_proxy;  // PlainAddress of whose X-Forwarded-For is believed; empty: nobody's
  };

  /// `access` and `sessions` outlive this.
  Gatekeeper(SessionTable& sessions, AccessBook& access, const Options& options)
      : sessions_(sessions),
        access_(access),
        trusted_proxy_(options.trusted_proxy),
        machines_(options.machines),
        admission_(options.limits),
        traffic_(options.traffic) {}

  /// Whose the token is that came with a call; without one, whose the certificate is with which the
  /// connection was made (tls.client_ca); else as AccessBook::Check without a token.
  absl::StatusOr<Access> Who(const Context& context) const;

  /// Before a message of `bytes` is parsed: ResourceExhausted, too much of them. What the gateway
  /// brings was asked there, before it was read (AdmitBrowser).
  absl::Status Arrive(const Context& context, std::size_t bytes);
  /// The same for the gateway: `address` is an IP literal, `authorization` the header of that name.
  absl::Status AdmitBrowser(absl::string_view address, absl::string_view authorization,
                            std::size_t bytes);

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
  /// Who calls, as PeerKey has it; for a browser its own address, which the gateway tells.
  std::string PeerOf(const Context& context) const;
  absl::StatusOr<Access> Check(const Context& context, Method method) const;
  absl::StatusOr<Session> FindSession(const Access& access, Method method,
                                      const std::string& session_id);

  SessionTable& sessions_;
  AccessBook& access_;
  const std::string trusted_proxy_;
  const MachineRoles machines_;
  Admission admission_;
  TrafficGate traffic_;
};

}  // namespace saccade
