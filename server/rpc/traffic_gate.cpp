#include "server/rpc/traffic_gate.hpp"

#include <absl/strings/str_cat.h>

#include "server/pipeline/busy.hpp"
#include "server/pipeline/peer_address.hpp"

namespace saccade {
namespace {

constexpr double kCourtesyShare = 0.2;  // of what a token may

RateLimit ShareOf(RateLimit limit) {
  return {limit.per_s * kCourtesyShare, limit.burst * kCourtesyShare};
}

absl::Status Judge(const std::optional<Timestamp>& wait_ns, const RateLimit& limit,
                   const char* what, const char* whose) {
  if (!wait_ns) return absl::OkStatus();
  return BusyError(absl::StrCat("more than ", limit.per_s, " ", what, " a second ", whose),
                   *wait_ns);
}

}  // namespace

TrafficGate::TrafficGate(const TrafficLimits& limits)
    : limits_(limits),
      courtesy_(ShareOf(limits.token_requests)),
      token_requests_(limits.token_requests),
      token_bytes_(limits.token_bytes),
      address_requests_(limits.address_requests),
      address_bytes_(limits.address_bytes),
      invite_requests_(limits.invite_requests),
      invite_bytes_(limits.invite_bytes) {}

absl::Status TrafficGate::Admit(const std::string& peer, const Access& access, std::size_t bytes,
                                Timestamp now_ns) {
  const double size = static_cast<double>(bytes);
  if (const std::string& id = access.id; !id.empty()) {
    absl::Status status =
        Judge(token_requests_.Take(id, now_ns), limits_.token_requests, "calls", "with this pass");
    if (status.ok()) {
      status = Judge(token_bytes_.Take(id, now_ns, size), limits_.token_bytes, "bytes",
                     "with this pass");
    }
    // Who redeems a link many times has many passes, but no more than a room full of people.
    if (const std::string& invite = access.invite_id; status.ok() && !invite.empty()) {
      status = Judge(invite_requests_.Take(invite, now_ns), limits_.invite_requests, "calls",
                     "by everybody with this invite");
      if (status.ok()) {
        status = Judge(invite_bytes_.Take(invite, now_ns, size), limits_.invite_bytes, "bytes",
                       "by everybody with this invite");
      }
    }
    if (!status.ok() || !courtesy_.Take(id, now_ns)) return status;
  }
  if (!limits_.this_machine && IsThisMachine(peer)) return absl::OkStatus();
  absl::Status status = Judge(address_requests_.Take(peer, now_ns), limits_.address_requests,
                              "calls", "from this address");
  if (!status.ok()) return status;
  return Judge(address_bytes_.Take(peer, now_ns, size), limits_.address_bytes, "bytes",
               "from this address");
}

}  // namespace saccade
