#include "server/rpc/gatekeeper.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/auth_context.h>

#include <iterator>

#include "server/identity/role_table.hpp"
#include "server/pipeline/peer_address.hpp"

namespace saccade {
namespace {

// The gateway's name for it (server/gateway/upstream_call.hpp), believed only in process.
constexpr char kPeerMetadata[] = "x-saccade-peer";

std::string Metadata(const grpc::CallbackServerContext& context, const char* name) {
  // Of several the last one: what a proxy adds, it adds behind what it was sent.
  const auto [first, end] = context.client_metadata().equal_range(name);
  if (first == end) return "";
  const grpc::string_ref& last = std::prev(end)->second;
  return {last.data(), last.size()};
}

// "ipv4:127.0.0.1:50123", "ipv6:%5B::1%5D:50123"; of "unix:..." nothing.
std::string SocketAddress(const std::string& peer) {
  const std::string plain = absl::StrReplaceAll(peer, {{"%5B", "["}, {"%5D", "]"}});
  const std::size_t port = plain.rfind(':');
  if (absl::StartsWith(plain, "ipv4:") && port > 5) return plain.substr(5, port - 5);
  const std::size_t open = plain.find('['), close = plain.find(']');
  if (absl::StartsWith(plain, "ipv6:") && open != std::string::npos && close > open) {
    return plain.substr(open + 1, close - open - 1);
  }
  return "";
}

Access Known(const absl::StatusOr<Access>& access) { return access.ok() ? *access : Access(); }

bool IsInProcess(const grpc::CallbackServerContext& context) {
  return absl::StartsWith(context.peer(), "inproc");
}

}  // namespace

absl::string_view TokenOf(const grpc::CallbackServerContext& context) {
  const auto& metadata = context.client_metadata();
  const auto at = metadata.find("authorization");
  if (at == metadata.end()) return {};
  return TokenIn({at->second.data(), at->second.size()});
}

std::string Gatekeeper::PeerOf(const Context& context) const {
  if (IsInProcess(context)) {
    const std::string address = Metadata(context, kPeerMetadata);
    return address.empty() ? "inproc" : PeerKey(address);
  }
  const std::string caller = SocketAddress(context.peer());
  if (caller.empty()) return context.peer();
  if (trusted_proxy_.empty() || PlainAddress(caller) != trusted_proxy_) return PeerKey(caller);
  const std::string address = ForwardedFor(Metadata(context, "x-forwarded-for"));
  return PeerKey(address.empty() ? caller : address);
}

absl::Status Gatekeeper::Arrive(const Context& context, std::size_t bytes) {
  if (IsInProcess(context)) return absl::OkStatus();
  return traffic_.Admit(PeerOf(context), Known(Who(context)), bytes, MonotonicNow());
}

absl::Status Gatekeeper::AdmitBrowser(absl::string_view address, absl::string_view authorization,
                                      std::size_t bytes) {
  return traffic_.Admit(PeerKey(address), Known(access_.Check(TokenIn(authorization))), bytes,
                        MonotonicNow());
}

absl::StatusOr<Access> Gatekeeper::Who(const Context& context) const {
  const absl::string_view token = TokenOf(context);
  if (!token.empty() || !access_.token_required()) return access_.Check(token);
  const std::shared_ptr<const grpc::AuthContext> shown = context.auth_context();
  if (shown == nullptr || !shown->IsPeerAuthenticated()) return access_.Check(token);
  Access machine{"", AccessRole::kViewer, 0};
  for (const char* kind : {GRPC_PEER_URI_PROPERTY_NAME, GRPC_X509_CN_PROPERTY_NAME}) {
    for (const grpc::string_ref& value : shown->FindPropertyValues(kind)) {
      const std::string name(value.data(), value.size());
      if (machine.id.empty()) machine.id = absl::StrCat("machine:", name);
      const auto role = machines_.find(name);
      if (role == machines_.end()) continue;
      return Access{absl::StrCat("machine:", name), role->second, 0};
    }
  }
  return machine.id.empty() ? access_.Check(token) : machine;
}

absl::StatusOr<Access> Gatekeeper::Check(const Context& context, Method method) const {
  const std::optional<AccessRole> least = LeastRole(method);
  if (!least) {
    return absl::PermissionDeniedError(
        absl::StrCat("access: ", method, " is not in the table of roles, so nobody may call it"));
  }
  absl::StatusOr<Access> access = Who(context);
  if (*least == AccessRole::kAnyone) return access.ok() ? access : Access{"", *least, 0};
  if (access.ok() && access->waiting) {
    return absl::PermissionDeniedError(
        "access: you wait to be let in; the wearer, or who started the server, decides");
  }
  if (!access.ok() || access->role >= *least) return access;
  return absl::PermissionDeniedError(absl::StrCat("access: this takes the role ", Word(*least),
                                                  ", and yours is ", Word(access->role),
                                                  "; ask for another invite"));
}

absl::StatusOr<Access> Gatekeeper::Enter(const Context& context, Method method,
                                         std::optional<Toll> toll) {
  absl::StatusOr<Access> access = Check(context, method);
  // Who guesses at tokens pays as a stranger.
  if (!access.ok()) toll = Toll::kRead;
  if (!toll) return access;
  const absl::Status often = admission_.Anyone(*toll, PeerOf(context), MonotonicNow());
  if (!often.ok()) return often;
  return access;
}

absl::StatusOr<Session> Gatekeeper::FindSession(const Access& access, Method method,
                                                const std::string& session_id) {
  const bool changes = LeastRole(method) > AccessRole::kViewer;
  absl::StatusOr<Session> session =
      changes ? sessions_.FindEditor(session_id) : sessions_.Find(session_id);
  // As if there were none: a stolen session_id is of no use with another token, nor without one.
  if (session.ok() && session->access_id != access.id) return SessionTable::UnknownSession();
  return session;
}

absl::StatusOr<Session> Gatekeeper::Member(const Context& context, Method method,
                                           std::optional<Toll> toll,
                                           const std::string& session_id) {
  const absl::StatusOr<Access> access = Check(context, method);
  absl::StatusOr<Session> session =
      access.ok() ? FindSession(*access, method, session_id) : access.status();
  const std::string peer = PeerOf(context);
  const Timestamp now_ns = MonotonicNow();
  absl::Status often;
  // Who guesses at sessions or tokens is a stranger as well.
  if (!session.ok()) often = admission_.Anyone(Toll::kRead, peer, now_ns);
  if (session.ok() && toll) {
    often = admission_.Participant(*toll, session->participant_id, peer, now_ns);
  }
  if (!often.ok()) return often;
  return session;
}

}  // namespace saccade
