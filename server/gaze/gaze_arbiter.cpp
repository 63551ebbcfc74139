#include "server/gaze/gaze_arbiter.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/pipeline/busy.hpp"

namespace saccade {
namespace {

// The whole queue is told to everybody with each change.
constexpr std::size_t kMaxQueue = 16;

Timestamp Ns(double seconds) { return static_cast<Timestamp>(std::llround(1e9 * seconds)); }

std::string NameOf(const GazePilot& pilot) {
  return pilot.display_name.empty() ? "somebody" : pilot.display_name;
}

std::string Words(Handover::Why why, const std::optional<GazePilot>& from,
                  const std::optional<GazePilot>& to) {
  const std::string after = to ? absl::StrCat("; ", NameOf(*to), " pilots") : "; nobody pilots";
  switch (why) {
    case Handover::Why::kGranted:
      return absl::StrCat(NameOf(*to), " pilots");
    case Handover::Why::kReleased:
      return absl::StrCat(NameOf(*from), " released", after);
    case Handover::Why::kVanished:
      return absl::StrCat(NameOf(*from), " vanished", after);
    case Handover::Why::kOverridden:
      return from ? absl::StrCat("the wearer took over from ", NameOf(*from))
                  : "the wearer took over";
    case Handover::Why::kWearerDone:
      return absl::StrCat("the wearer gave the head back", after);
  }
  return "";
}

}  // namespace

bool GazeArbiter::Holds(const GazeCaller& caller) const {
  return lease_ && lease_->caller.pilot.participant_id == caller.pilot.participant_id;
}

std::optional<GazePilot> GazeArbiter::pilot() const {
  if (!lease_) return std::nullopt;
  return lease_->caller.pilot;
}

std::vector<GazePilot> GazeArbiter::queue() const {
  std::vector<GazePilot> pilots;
  for (const Waiting& waiting : queue_) pilots.push_back(waiting.caller.pilot);
  return pilots;
}

std::vector<Handover> GazeArbiter::TakeHandovers() { return std::exchange(handovers_, {}); }

void GazeArbiter::Hand(Handover::Why why, std::optional<GazeCaller> to, Timestamp now_ns,
                       double grace_s) {
  Handover change;
  change.why = why;
  change.from = pilot();
  if (to) {
    change.to = to->pilot;
    std::erase_if(queue_, [&](const Waiting& waiting) {
      return waiting.caller.pilot.participant_id == to->pilot.participant_id;
    });
    // The wearer is given as long as ever to be heard of.
    const double silence_s = to->wearer ? std::max(grace_s, SilenceOf(*to)) : grace_s;
    lease_ = Lease{new_id_(), *std::move(to), now_ns + Ns(silence_s)};
  } else {
    lease_.reset();
  }
  change.words = Words(why, change.from, change.to);
  last_words_ = change.words;
  ++count_;
  handovers_.push_back(std::move(change));
}

double GazeArbiter::SilenceOf(const GazeCaller& caller) const {
  return caller.wearer ? options_.wearer_silence_s : options_.heartbeat_s;
}

void GazeArbiter::Renew(Timestamp now_ns) {
  lease_->expires_ns = std::max(lease_->expires_ns, now_ns + Ns(SilenceOf(lease_->caller)));
}

void GazeArbiter::HandToNext(Handover::Why why, Timestamp now_ns) {
  std::optional<GazeCaller> next;
  if (!queue_.empty()) next = queue_.front().caller;
  // The next one has to notice first.
  Hand(why, std::move(next), now_ns, options_.turn_grace_s);
}

absl::StatusOr<LeaseAnswer> GazeArbiter::Acquire(const GazeCaller& caller,
                                                 const std::string& lease_id, Timestamp now_ns) {
  Tick(now_ns);
  if (!lease_id.empty() && (!Holds(caller) || lease_->id != lease_id)) {
    return absl::FailedPreconditionError(absl::StrCat(
        "lease_id: is no longer in force",
        last_words_.empty() ? "" : absl::StrCat(" (", last_words_, ")"), ": ask again without it"));
  }
  if (!lease_) Hand(Handover::Why::kGranted, caller, now_ns, options_.heartbeat_s);
  LeaseAnswer answer;
  answer.pilot = lease_->caller.pilot;
  if (Holds(caller)) {
    lease_->expires_ns = now_ns + Ns(SilenceOf(caller));
    answer.granted = true;
    answer.lease_id = lease_->id;
    return answer;
  }
  auto place = std::find_if(queue_.begin(), queue_.end(), [&](const Waiting& waiting) {
    return waiting.caller.pilot.participant_id == caller.pilot.participant_id;
  });
  if (place == queue_.end()) {
    if (queue_.size() >= kMaxQueue) {
      return BusyError(absl::StrCat("lease: ", queue_.size(), " wait already, as many as may"),
                       Ns(options_.queue_silence_s));
    }
    place = queue_.insert(queue_.end(), {caller, now_ns});
  }
  place->seen_ns = now_ns;
  answer.queue_position = static_cast<std::size_t>(place - queue_.begin()) + 1;
  return answer;
}

absl::Status GazeArbiter::Release(const GazeCaller& caller, Timestamp now_ns) {
  if (Holds(caller)) {
    HandToNext(caller.wearer ? Handover::Why::kWearerDone : Handover::Why::kReleased, now_ns);
    return absl::OkStatus();
  }
  const std::size_t left = std::erase_if(queue_, [&](const Waiting& waiting) {
    return waiting.caller.pilot.participant_id == caller.pilot.participant_id;
  });
  if (left > 0) return absl::OkStatus();
  return absl::FailedPreconditionError("lease: you neither hold it nor wait for it");
}

absl::Status GazeArbiter::MaySteer(const GazeCaller& caller, Timestamp now_ns) {
  Tick(now_ns);
  if (paused_) {
    return absl::FailedPreconditionError("gaze: the wearer has paused it; wait until it is lifted");
  }
  if (!lease_) return absl::FailedPreconditionError("gaze: acquire the lease first");
  if (!Holds(caller)) {
    return absl::PermissionDeniedError(
        absl::StrCat("gaze: ", NameOf(lease_->caller.pilot),
                     " pilots; acquire the lease to wait for your turn"));
  }
  Renew(now_ns);
  return absl::OkStatus();
}

absl::Status GazeArbiter::Override(const GazeCaller& caller, bool enabled, Timestamp now_ns) {
  if (!caller.wearer) {
    return absl::PermissionDeniedError("session_id: only the wearer takes over");
  }
  Tick(now_ns);
  if (!enabled) return Release(caller, now_ns);
  if (Holds(caller)) {
    Renew(now_ns);
    return absl::OkStatus();
  }
  // Who loses the head is the first to have it back; but there is one wearer, and an earlier one
  // who still held it is not somebody to give it back to.
  if (lease_ && !lease_->caller.wearer) queue_.insert(queue_.begin(), {lease_->caller, now_ns});
  Hand(Handover::Why::kOverridden, caller, now_ns, options_.heartbeat_s);
  return absl::OkStatus();
}

absl::Status GazeArbiter::Pause(const GazeCaller& caller, bool paused) {
  if (!caller.wearer) return absl::PermissionDeniedError("session_id: only the wearer pauses");
  paused_ = paused;
  return absl::OkStatus();
}

void GazeArbiter::Tick(Timestamp now_ns) {
  std::erase_if(queue_, [&](const Waiting& waiting) {
    return Seconds(now_ns - waiting.seen_ns) > options_.queue_silence_s;
  });
  if (lease_ && lease_->caller.wearer && present_ &&
      present_(lease_->caller.pilot.participant_id)) {
    Renew(now_ns);
  }
  while (lease_ && now_ns > lease_->expires_ns) HandToNext(Handover::Why::kVanished, now_ns);
}

}  // namespace saccade
