#include "server/rpc/gatekeeper.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>
#include <arpa/inet.h>

#include <array>

#include "server/identity/role_table.hpp"

namespace saccade {
namespace {

// The gateway's name for it (server/gateway/upstream_call.hpp), believed only in process.
constexpr char kPeerMetadata[] = "x-saccade-peer";
constexpr absl::string_view kBearer = "bearer ";

std::string Address(const std::string& address) {
  std::array<unsigned char, 16> bytes{};
  if (inet_pton(AF_INET6, address.c_str(), bytes.data()) != 1) {
    return absl::StrCat("ipv4:", address);
  }
  std::string network = "ipv6:";
  for (std::size_t i = 0; i < 8; ++i)
    absl::StrAppend(&network, absl::Hex(bytes[i], absl::kZeroPad2));
  return network;
}

}  // namespace

std::string PeerOf(const grpc::CallbackServerContext& context) {
  const std::string peer = context.peer();
  if (absl::StartsWith(peer, "inproc")) {
    const auto& metadata = context.client_metadata();
    const auto at = metadata.find(kPeerMetadata);
    if (at == metadata.end()) return "inproc";
    return Address(std::string(at->second.data(), at->second.size()));
  }
  // "ipv4:127.0.0.1:50123", "ipv6:%5B::1%5D:50123", "unix:..."
  const std::string plain = absl::StrReplaceAll(peer, {{"%5B", "["}, {"%5D", "]"}});
  const std::size_t port = plain.rfind(':');
  if (absl::StartsWith(plain, "ipv4:") && port > 5) return Address(plain.substr(5, port - 5));
  const std::size_t open = plain.find('['), close = plain.find(']');
  if (absl::StartsWith(plain, "ipv6:") && open != std::string::npos && close > open) {
    return Address(plain.substr(open + 1, close - open - 1));
  }
  return plain;
}

absl::string_view TokenOf(const grpc::CallbackServerContext& context) {
  const auto& metadata = context.client_metadata();
  const auto at = metadata.find("authorization");
  if (at == metadata.end()) return {};
  absl::string_view value(at->second.data(), at->second.size());
  if (!absl::StartsWithIgnoreCase(value, kBearer))
    return value;  // no token of ours, and so refused
  return absl::StripAsciiWhitespace(value.substr(kBearer.size()));
}

absl::StatusOr<Access> Gatekeeper::Check(const Context& context, Method method) const {
  const std::optional<AccessRole> least = LeastRole(method);
  if (!least) {
    return absl::PermissionDeniedError(
        absl::StrCat("access: ", method, " is not in the table of roles, so nobody may call it"));
  }
  absl::StatusOr<Access> access = access_.Check(TokenOf(context));
  if (*least == AccessRole::kAnyone) return access.ok() ? access : Access{"", *least, 0};
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
