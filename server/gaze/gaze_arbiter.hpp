#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/gaze/gaze_options.hpp"
#include "server/pipeline/gaze_commands.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// The lease changed hands.
struct Handover {
  enum class Why { kGranted, kReleased, kVanished, kOverridden, kWearerDone };
  Why why = Why::kGranted;
  std::optional<GazePilot> from, to;
  std::string words;  // for everybody to read
};

/// One pilot at a time, by lease; the others queue. The pilot's heartbeat is any call of his; after
/// `heartbeat_s` of silence he is gone. The wearer needs no heartbeat while his stream is open:
/// what he took he keeps until he gives it back, or is gone himself. Pure logic with explicit time;
/// one thread.
class GazeArbiter {
 public:
  /// `new_id` makes lease ids (UUIDs).
  GazeArbiter(const GazeOptions& options, std::function<std::string()> new_id)
      : options_(options), new_id_(std::move(new_id)) {}

  /// Grants, renews or queues.
  ///   FailedPrecondition  `lease_id` given, but it is not (or no longer) the one in force
  ///   ResourceExhausted   as many as may wait already
  absl::StatusOr<LeaseAnswer> Acquire(const GazeCaller& caller, const std::string& lease_id,
                                      Timestamp now_ns);
  /// FailedPrecondition: neither pilot nor in the queue.
  absl::Status Release(const GazeCaller& caller, Timestamp now_ns);
  /// Whether the caller may move the head; a heartbeat if so.
  ///   PermissionDenied    somebody else pilots: names him
  ///   FailedPrecondition  nobody does (acquire the lease first), or the wearer has paused
  absl::Status MaySteer(const GazeCaller& caller, Timestamp now_ns);
  /// PermissionDenied: only the wearer.
  absl::Status Override(const GazeCaller& caller, bool enabled, Timestamp now_ns);
  absl::Status Pause(const GazeCaller& caller, bool paused);

  /// Whether a participant has a stream; without this nobody has.
  using Present = std::function<bool(const std::string& participant_id)>;
  void SetPresence(Present present) { present_ = std::move(present); }

  /// Notices who is gone. To be called at least every 50 ms.
  void Tick(Timestamp now_ns);

  /// Changes of hands since the last call, in order.
  std::vector<Handover> TakeHandovers();

  std::optional<GazePilot> pilot() const;
  std::vector<GazePilot> queue() const;
  bool paused() const { return paused_; }
  std::uint64_t handovers() const { return count_; }
  const std::string& last_words() const { return last_words_; }

 private:
  struct Lease {
    std::string id;
    GazeCaller caller;
    Timestamp expires_ns = 0;
  };
  struct Waiting {
    GazeCaller caller;
    Timestamp seen_ns = 0;
  };
  void Hand(Handover::Why why, std::optional<GazeCaller> to, Timestamp now_ns, double grace_s);
  /// To the first in the queue, or to nobody.
  void HandToNext(Handover::Why why, Timestamp now_ns);
  bool Holds(const GazeCaller& caller) const;
  void Renew(Timestamp now_ns);
  double SilenceOf(const GazeCaller& caller) const;

  const GazeOptions options_;
  const std::function<std::string()> new_id_;
  Present present_;
  std::optional<Lease> lease_;
  std::vector<Waiting> queue_;
  bool paused_ = false;
  std::vector<Handover> handovers_;
  std::uint64_t count_ = 0;
  std::string last_words_;
};

}  // namespace saccade
