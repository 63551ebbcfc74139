#include "server/pipeline/connection_limits.hpp"

#include <absl/strings/str_cat.h>

#include "server/pipeline/busy.hpp"
#include "server/pipeline/peer_address.hpp"

namespace saccade {
namespace {

constexpr Timestamp kAgain_ns = 5'000'000'000;  // who is slow is closed after ten seconds

}  // namespace

bool ConnectionGate::IsProxy(absl::string_view address) const {
  return !limits_.trusted_proxy.empty() && PlainAddress(address) == limits_.trusted_proxy;
}

bool ConnectionGate::Counts(const std::string& peer) const {
  return limits_.this_machine || !IsThisMachine(peer);
}

absl::Status ConnectionGate::Hurry(const std::string& peer, Timestamp now_ns) {
  if (!Counts(peer)) return absl::OkStatus();
  const auto wait_ns = new_.Take(peer, now_ns);
  if (!wait_ns) return absl::OkStatus();
  return BusyError(absl::StrCat("connections: more than ", limits_.new_of_address.per_s,
                                " new ones a second from this address"),
                   *wait_ns);
}

absl::Status ConnectionGate::Admit(const std::string& peer, const ConnectionCounts& counts) const {
  if (!Counts(peer)) return absl::OkStatus();
  if (limits_.of_address > 0 && counts.of_address >= limits_.of_address) {
    return BusyError(absl::StrCat("connections: ", counts.of_address,
                                  " are open from this address, as many as may be"),
                     kAgain_ns);
  }
  if (limits_.of_network > 0 && counts.of_network >= limits_.of_network) {
    return BusyError(absl::StrCat("connections: ", counts.of_network,
                                  " are open from this network, as many as may be"),
                     kAgain_ns);
  }
  if (limits_.unheard_of_address > 0 && counts.unheard_of_address >= limits_.unheard_of_address) {
    return BusyError(absl::StrCat("connections: ", counts.unheard_of_address,
                                  " from this address have not said anything yet, as many as may"),
                     kAgain_ns);
  }
  return absl::OkStatus();
}

}  // namespace saccade
