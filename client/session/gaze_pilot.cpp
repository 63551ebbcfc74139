#include "client/session/gaze_pilot.hpp"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace saccade::session {
namespace {

constexpr std::chrono::milliseconds kBeat(150);  // the server waits 500 ms for one
constexpr std::chrono::milliseconds kDeadline(1000);

bool MayPass(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsUnknown(status) || absl::IsCancelled(status) || absl::IsAborted(status) ||
         absl::IsResourceExhausted(status);
}

}  // namespace

/// Asks for the lease, keeps a place in the queue, renews what was granted.
class GazePilot::Heartbeat {
 public:
  explicit Heartbeat(net::ConnectionOptions options) {
    options.deadline = kDeadline;
    thread_ = std::jthread([this, options](std::stop_token stop) { Run(options, stop); });
  }

  /// What came of the newest beat that told something; nothing since the last Take().
  std::optional<absl::StatusOr<net::Lease>> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(told_, std::nullopt);
  }

 private:
  void Run(const net::ConnectionOptions& options, std::stop_token stop) {
    const auto connection = net::Connection::Create(options);
    if (!connection.ok()) return Tell(connection.status());
    std::string id;
    while (!stop.stop_requested()) {
      absl::StatusOr<net::Lease> lease = (*connection)->AcquireLease(id);
      if (lease.ok()) id = lease->lease_id;
      if (lease.ok() || !MayPass(lease.status())) Tell(lease);
      if (!lease.ok() && !MayPass(lease.status())) return;
      std::unique_lock lock(mutex_);
      stopped_.wait_for(lock, stop, kBeat, [] { return false; });
    }
  }

  void Tell(absl::StatusOr<net::Lease> told) {
    const std::lock_guard lock(mutex_);
    told_ = std::move(told);
  }

  std::mutex mutex_;
  std::condition_variable_any stopped_;
  std::optional<absl::StatusOr<net::Lease>> told_;
  std::jthread thread_;  // last: it uses what stands above
};

GazePilot::GazePilot(Session& session) : session_(session) {}
GazePilot::~GazePilot() = default;

void GazePilot::End(std::string why) {
  heartbeat_.reset();
  kind_ = Kind::kNone;
  lost_ = std::move(why);
  wanted_ = nullptr;
  if (const Done done = std::exchange(wanted_done_, nullptr)) {
    done(absl::FailedPreconditionError(lost_));
  }
}

bool GazePilot::Check() {
  if (heartbeat_ == nullptr) return false;
  if (owner_ != session_.state().session_id) {
    End("A new session has begun; the lease ended with the old one.");
    return true;
  }
  const std::optional<absl::StatusOr<net::Lease>> told = heartbeat_->Take();
  if (!told) return false;
  if (!told->ok()) {
    const bool held = kind_ == Kind::kHeld;
    End(held ? absl::StrCat("You pilot no longer: ", told->status().message(), ".")
             : std::string(told->status().message()));
    return true;
  }
  const net::Lease& lease = **told;
  const Kind now = lease.granted ? Kind::kHeld : Kind::kWaiting;
  const bool changed = now != kind_ || position_ != lease.queue_position;
  kind_ = now;
  position_ = lease.queue_position;
  pilot_ = lease.pilot.display_name.empty() ? "somebody" : lease.pilot.display_name;
  if (now == Kind::kHeld && wanted_) {
    Send(std::exchange(wanted_, nullptr), std::exchange(wanted_done_, nullptr));
  } else if (now == Kind::kWaiting && wanted_done_) {
    wanted_ = nullptr;
    std::exchange(wanted_done_, nullptr)(absl::FailedPreconditionError(
        absl::StrCat(pilot_, " pilots. You are number ", position_,
                     " in the queue: try again when it is your turn.")));
  }
  return changed;
}

void GazePilot::Send(std::function<absl::StatusOr<GazeSnapshot>(net::Connection&)> call,
                     Done done) {
  const absl::Status asked =
      session_.Ask([call = std::move(call), done](net::Connection& connection) -> Session::Answer {
        return [gaze = call(connection), done](State& state) {
          if (!gaze.ok()) return done(gaze.status());
          // Usually ahead of the stream's.
          if (!state.gaze || gaze->time_ns > state.gaze->time_ns) state.gaze = *gaze;
          done(std::string());
        };
      });
  if (!asked.ok()) done(asked);
}

void GazePilot::Steer(std::function<absl::StatusOr<GazeSnapshot>(net::Connection&)> call,
                      Done done) {
  if (kind_ == Kind::kHeld) return Send(std::move(call), std::move(done));
  const std::optional<net::ConnectionOptions> options = session_.connection();
  if (!options || !session_.state().link.live()) {
    return done(absl::UnavailableError("no connection to the server"));
  }
  wanted_ = std::move(call);
  wanted_done_ = std::move(done);
  lost_.clear();
  if (heartbeat_ != nullptr) return;
  owner_ = session_.state().session_id;
  heartbeat_ = std::make_unique<Heartbeat>(*options);
}

void GazePilot::Fixate(const GazeTarget& target, bool fast, Done done) {
  Steer([target, fast](net::Connection& connection) { return connection.Fixate(target, fast); },
        std::move(done));
}

void GazePilot::Run(Command command, Done done) {
  Steer([command](net::Connection& connection) { return (connection.*command)(); },
        std::move(done));
}

void GazePilot::Toggle(Done done) {
  if (heartbeat_ == nullptr) {
    return Steer([](net::Connection& connection) { return connection.GetGaze(); }, std::move(done));
  }
  End("");
  const absl::Status asked = session_.Ask([done](net::Connection& connection) -> Session::Answer {
    return [released = connection.ReleaseLease(), done](State& /*state*/) {
      done(released.ok() ? absl::StatusOr<std::string>("released") : released);
    };
  });
  if (!asked.ok()) done(asked);
}

}  // namespace saccade::session
