#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <variant>

#include "server/pipeline/commands.hpp"
#include "shared/scene/gaze.hpp"

namespace saccade {

/// Who asks.
struct GazeCaller {
  GazePilot pilot;
  bool wearer = false;  // may take over, pause and stop at any time
};

/// Answer to a request for the lease.
struct LeaseAnswer {
  bool granted = false;
  std::string lease_id;            // UUID, if granted
  std::size_t queue_position = 0;  // from 1, if not
  GazePilot pilot;                 // who holds it
};

/// Asks for the lease, or renews it (the heartbeat), or keeps the place in the queue.
struct AcquireGazeLease {
  GazeCaller caller;
  std::string lease_id;  // empty: a new request
  Done<LeaseAnswer> done;
};
/// Gives the lease back, or leaves the queue.
struct ReleaseGazeLease {
  GazeCaller caller;
  DoneEmpty done;
};
/// Commands of the pilot; each counts as a heartbeat.
struct FixateGaze {
  GazeCaller caller;
  GazeTarget target;
  bool fast = false;
  Done<std::shared_ptr<const GazeSnapshot>> done;  // as it is just after
};
struct SteerGaze {
  enum class What { kRelease, kHome, kStop, kHorizon, kExplore, kCalibrate };
  GazeCaller caller;
  What what = What::kStop;
  Done<std::shared_ptr<const GazeSnapshot>> done;
};
/// The wearer takes the lease from whoever has it, until he gives it back.
struct OverrideGaze {
  GazeCaller caller;
  bool enabled = true;
  DoneEmpty done;
};
/// The wearer: nobody moves the head until it is lifted.
struct PauseGaze {
  GazeCaller caller;
  bool paused = true;
  DoneEmpty done;
};

using GazeCommand = std::variant<AcquireGazeLease, ReleaseGazeLease, FixateGaze, SteerGaze,
                                 OverrideGaze, PauseGaze>;

/// Answers a command that will not be carried out.
inline void Fail(const GazeCommand& command, const absl::Status& status) {
  std::visit([&status](const auto& one) { one.done(status); }, command);
}

}  // namespace saccade
