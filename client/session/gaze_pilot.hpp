#pragma once

#include <memory>
#include <string>

#include "client/session/edits.hpp"
#include "client/session/session.hpp"

namespace saccade::session {

/// Pilots the head by lease: asks, queues, keeps the lease for as long as this client lives,
/// notices when it is gone. No heartbeat leaves without a lease or a place in the queue. The thread
/// that draws; heartbeats have one of their own.
class GazePilot {
 public:
  enum class Kind { kNone, kWaiting, kHeld };
  using Done = Edits::Done;
  using Command = absl::StatusOr<GazeSnapshot> (net::Connection::*)();

  explicit GazePilot(Session& session);
  ~GazePilot();

  Kind kind() const { return kind_; }
  std::uint32_t position() const { return position_; }  // in the queue, from 1
  const std::string& pilot() const { return pilot_; }   // who has it, while one waits
  /// Why the lease went, in words; empty once asked for anew.
  const std::string& lost() const { return lost_; }

  /// Looks at it, with the lease; asks for that first.
  void Fixate(const GazeTarget& target, bool fast, Done done);
  /// Home, KeepHorizon, Explore, StopFixating, likewise.
  void Run(Command command, Done done);
  /// Asks for the lease, or gives it (or the place in the queue) back.
  void Toggle(Done done);
  /// To be called after each Poll(): takes in what the heartbeats were told. True if it changed.
  bool Check();

 private:
  class Heartbeat;
  void Steer(std::function<absl::StatusOr<GazeSnapshot>(net::Connection&)> call, Done done);
  void Send(std::function<absl::StatusOr<GazeSnapshot>(net::Connection&)> call, Done done);
  void End(std::string why);

  Session& session_;
  Kind kind_ = Kind::kNone;
  std::uint32_t position_ = 0;
  std::string pilot_, lost_, owner_;
  std::unique_ptr<Heartbeat> heartbeat_;
  std::function<absl::StatusOr<GazeSnapshot>(net::Connection&)> wanted_;  // once it is granted
  Done wanted_done_;
};

}  // namespace saccade::session
