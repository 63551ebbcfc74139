#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <thread>

#include "client/cli/commands.hpp"
#include "client/cli/interrupt.hpp"
#include "client/cli/text.hpp"
#include "shared/geometry/angle.hpp"

namespace saccade::cli {
namespace {

constexpr std::chrono::milliseconds kHeartbeat(100);  // the server waits 500 ms for one
constexpr double kHome_rad = 0.5 * kDegree;

std::string StateText(const GazeSnapshot& state) {
  std::string text = ToString(state.mode);
  if (state.error_rad) {
    absl::StrAppend(&text, absl::StrFormat(", %s %.1f deg", state.arrived ? "holding to" : "off by",
                                           *state.error_rad / kDegree));
  }
  if (!state.reachable) {
    absl::StrAppend(&text, absl::StrFormat(", unreachable by %.1f deg", state.miss_rad / kDegree));
  }
  if (state.target_lost) absl::StrAppend(&text, ", target lost");
  if (state.paused) absl::StrAppend(&text, ", paused by the wearer");
  if (!state.problem.empty()) absl::StrAppend(&text, ": ", state.problem);
  return text;
}

/// Says how it is when that has changed, or once a second.
class StatePrinter {
 public:
  explicit StatePrinter(bool json) : json_(json) {}

  void Print(const GazeSnapshot& state) {
    const auto now = std::chrono::steady_clock::now();
    const bool same = state.mode == mode_ && state.arrived == arrived_ && state.problem == problem_;
    if (same && now < next_) return;
    next_ = now + std::chrono::seconds(1);
    mode_ = state.mode;
    arrived_ = state.arrived;
    problem_ = state.problem;
    std::cout << (json_ ? Dump(ToJson(state)) : StateText(state)) << std::endl;
  }

 private:
  const bool json_;
  GazeMode mode_ = GazeMode::kNoMount;
  bool arrived_ = false;
  std::string problem_;
  std::chrono::steady_clock::time_point next_;
};

/// Heartbeats until `done` holds of the state, `for_s` has passed (0: never) or somebody
/// interrupts.
absl::StatusOr<GazeSnapshot> Hold(net::Connection& connection, const std::string& lease_id,
                                  double for_s, StatePrinter& printer,
                                  const std::function<bool(const GazeSnapshot&)>& done) {
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * for_s));
  while (true) {
    const absl::StatusOr<net::Lease> lease = connection.AcquireLease(lease_id);
    if (!lease.ok()) return lease.status();
    absl::StatusOr<GazeSnapshot> state = connection.GetGaze();
    if (!state.ok()) return state.status();
    printer.Print(*state);
    if (done(*state) || Interrupted()) return state;
    if (for_s > 0 && std::chrono::steady_clock::now() >= end) return state;
    std::this_thread::sleep_for(kHeartbeat);
  }
}

absl::Status RunFixate(const Options& options, net::Connection& connection) {
  const absl::StatusOr<std::string> lease = TakeLease(connection);
  if (!lease.ok()) return lease.status();
  StatePrinter printer(options.json);
  const absl::StatusOr<GazeSnapshot> begun = connection.Fixate(options.gaze, options.fast);
  if (!begun.ok()) {
    connection.ReleaseLease().IgnoreError();
    return begun.status();
  }
  bool arrived = false;
  const absl::StatusOr<GazeSnapshot> last =
      Hold(connection, *lease, options.gaze_s, printer, [&](const GazeSnapshot& state) {
        arrived |= state.arrived;
        return state.mode == GazeMode::kStopped || state.mode == GazeMode::kHome;
      });
  if (!last.ok()) return last.status();
  const absl::Status released = connection.ReleaseLease();
  if (!released.ok()) return released;
  if (arrived || Interrupted() || last->mode == GazeMode::kStopped) return absl::OkStatus();
  return absl::DeadlineExceededError(absl::StrCat("did not arrive: ", StateText(*last)));
}

absl::Status RunHome(const Options& options, net::Connection& connection) {
  const absl::StatusOr<std::string> lease = TakeLease(connection);
  if (!lease.ok()) return lease.status();
  StatePrinter printer(options.json);
  if (const auto begun = connection.Home(); !begun.ok()) return begun.status();
  const double for_s = options.gaze_s > 0 ? options.gaze_s : 20.0;
  const absl::StatusOr<GazeSnapshot> last =
      Hold(connection, *lease, for_s, printer, [](const GazeSnapshot& state) {
        return state.joints_rad && state.joints_rad->cwiseAbs().maxCoeff() < kHome_rad;
      });
  if (!last.ok()) return last.status();
  return connection.ReleaseLease();
}

absl::Status RunStop(const Options& options, net::Connection& connection) {
  // Whoever holds the lease in this session may stop at once; else it has to be free.
  absl::StatusOr<GazeSnapshot> stopped = connection.StopFixating();
  if (absl::IsFailedPrecondition(stopped.status())) {
    const absl::StatusOr<std::string> lease = TakeLease(connection);
    if (!lease.ok()) return lease.status();
    stopped = connection.StopFixating();
    connection.ReleaseLease().IgnoreError();
  }
  if (!stopped.ok()) return stopped.status();
  StatePrinter(options.json).Print(*stopped);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::string> TakeLease(net::Connection& connection) {
  const absl::StatusOr<net::Lease> lease = connection.AcquireLease("");
  if (!lease.ok()) return lease.status();
  if (lease->granted) return lease->lease_id;
  connection.ReleaseLease().IgnoreError();  // whoever does not wait keeps no place
  return absl::UnavailableError(
      absl::StrCat(lease->pilot.display_name, " pilots the camera; try again when it is free"));
}

absl::Status RunGaze(const Options& options, net::Connection& connection) {
  HearInterrupts();
  switch (options.command) {
    case Command::kFixate:
      return RunFixate(options, connection);
    case Command::kHome:
      return RunHome(options, connection);
    case Command::kStop:
      return RunStop(options, connection);
    default:
      return connection.ReleaseLease();
  }
}

}  // namespace saccade::cli
