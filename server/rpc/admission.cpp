#include "server/rpc/admission.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/pipeline/busy.hpp"

namespace saccade {
namespace {

constexpr const char* kWhat[kTolls] = {"joins",
                                       "streams opened",
                                       "edits",
                                       "resets of the map",
                                       "stills",
                                       "gaze commands",
                                       "questions",
                                       "invites redeemed",
                                       "words of pointers",
                                       "pictures",
                                       "messages",
                                       "packets of voice"};

absl::Status Judge(const std::optional<Timestamp>& wait_ns, Toll toll, const char* whose) {
  if (!wait_ns) return absl::OkStatus();
  return BusyError(absl::StrCat("too many ", kWhat[static_cast<int>(toll)], whose), *wait_ns);
}

}  // namespace

const RpcLimits::Kind& RpcLimits::of(Toll toll) const {
  const Kind* const kinds[kTolls] = {&join, &subscribe, &edit,  &reset,   &still, &gaze,
                                     &read, &redeem,    &point, &picture, &say,   &speak};
  return *kinds[static_cast<int>(toll)];
}

RpcLimits RpcLimits::Scaled(double factor) const {
  RpcLimits scaled = *this;
  for (Kind* kind :
       {&scaled.join, &scaled.subscribe, &scaled.edit, &scaled.reset, &scaled.still, &scaled.gaze,
        &scaled.read, &scaled.redeem, &scaled.point, &scaled.picture, &scaled.say, &scaled.speak}) {
    for (RateLimit* limit : {&kind->courtesy, &kind->session, &kind->peer, &kind->server}) {
      limit->per_s *= factor;
      limit->burst = std::max(1.0, limit->burst * factor);
    }
  }
  scaled.voice_packets.per_s *= factor;
  scaled.voice_packets.burst = std::max(1.0, scaled.voice_packets.burst * factor);
  return scaled;
}

Admission::Admission(const RpcLimits& limits) {
  for (int toll = 0; toll < kTolls; ++toll) {
    limiters_[static_cast<std::size_t>(toll)] =
        std::make_unique<Limiters>(limits.of(static_cast<Toll>(toll)));
  }
}

absl::Status Admission::Anyone(Toll toll, const std::string& peer, Timestamp now_ns) {
  // The peer's own first: who floods uses up his share, not everybody's.
  absl::Status status = Judge(Of(toll).peer.Take(peer, now_ns), toll, " from this address");
  if (!status.ok()) return status;
  return Judge(Of(toll).server.Take("", now_ns), toll, "");
}

absl::Status Admission::Participant(Toll toll, const std::string& participant_id,
                                    const std::string& peer, Timestamp now_ns) {
  Limiters& limiters = Of(toll);
  if (limiters.has_courtesy && !limiters.courtesy.Take(participant_id, now_ns)) {
    return absl::OkStatus();
  }
  absl::Status status =
      Judge(limiters.session.Take(participant_id, now_ns), toll, " from this session");
  if (!status.ok()) return status;
  return Anyone(toll, peer, now_ns);
}

}  // namespace saccade
