#include "server/rpc/gatekeeper.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>
#include <arpa/inet.h>

#include <array>

namespace saccade {
namespace {

// The gateway's name for it (server/gateway/upstream_call.hpp), believed only in process.
constexpr char kPeerMetadata[] = "x-saccade-peer";

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

absl::Status Gatekeeper::Anyone(const Context& context, Toll toll) {
  return admission_.Anyone(toll, PeerOf(context), MonotonicNow());
}

absl::StatusOr<Session> Gatekeeper::Admit(const Context& context, Toll toll,
                                          absl::StatusOr<Session> session) {
  const std::string peer = PeerOf(context);
  const Timestamp now_ns = MonotonicNow();
  // Who guesses at sessions is a stranger as well.
  const absl::Status often =
      session.ok() ? admission_.Participant(toll, session->participant_id, peer, now_ns)
                   : admission_.Anyone(Toll::kRead, peer, now_ns);
  if (!often.ok()) return often;
  return session;
}

absl::StatusOr<Session> Gatekeeper::Member(const Context& context, Toll toll,
                                           const std::string& session_id) {
  return Admit(context, toll, sessions_.Find(session_id));
}

absl::StatusOr<Session> Gatekeeper::Editor(const Context& context, Toll toll,
                                           const std::string& session_id) {
  return Admit(context, toll, sessions_.FindEditor(session_id));
}

}  // namespace saccade
