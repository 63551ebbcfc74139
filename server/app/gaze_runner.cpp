#include "server/app/gaze_runner.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "server/anchors/edit_checks.hpp"
#include "server/pipeline/busy.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr std::chrono::milliseconds kStep(10);
constexpr Timestamp kTellEvery = 33'000'000;
// What a command changed is told at once; of a flood of commands the sum.
constexpr Timestamp kTellChangeEvery = 15'000'000;

}  // namespace

GazeRunner::GazeRunner(std::shared_ptr<Mount> mount, const GazeOptions& options,
                       std::size_t mailbox, Publish publish)
    : mount_(std::move(mount)),
      mailbox_(mailbox),
      publish_(std::move(publish)),
      loop_(*mount_, options, MakeUuid),
      newest_(loop_.snapshot()) {
  loop_.SetListener([this](const std::shared_ptr<const GazeSnapshot>& state) {
    const std::lock_guard lock(mutex_);
    newest_ = state;
  });
  loop_.SetPresence([this](const std::string& participant_id) {
    const std::lock_guard lock(mutex_);
    return present_ != nullptr && present_->contains(participant_id);
  });
}

void GazeRunner::SetPresence(std::shared_ptr<const absl::flat_hash_set<std::string>> present) {
  const std::lock_guard lock(mutex_);
  present_ = std::move(present);
}

void GazeRunner::Start() {
  thread_ = std::jthread([this](std::stop_token stop) { Run(stop); });
}

void GazeRunner::Stop() {
  std::deque<Arrived> left;
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(stopped_, true)) return;
    left.swap(commands_);
  }
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  mount_->Stop();
  for (const Arrived& one : left) {
    Fail(one.command, absl::UnavailableError("the server is shutting down"));
  }
}

absl::Status GazeRunner::Submit(GazeCommand command) {
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return absl::UnavailableError("the server is shutting down");
    if (commands_.size() >= mailbox_) {
      return BusyError("too many gaze commands are waiting", 200'000'000);
    }
    commands_.push_back({MonotonicNow(), std::move(command)});
  }
  changed_.notify_one();
  return absl::OkStatus();
}

void GazeRunner::OnView(GazeView view) {
  {
    const std::lock_guard lock(mutex_);
    view_ = std::move(view);
  }
  changed_.notify_one();
}

std::shared_ptr<const GazeSnapshot> GazeRunner::snapshot() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

GazeRunner::Work GazeRunner::WaitFor(std::chrono::steady_clock::time_point until,
                                     std::stop_token stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, stop, until,
                      [this] { return !commands_.empty() || view_.has_value(); });
  return {std::exchange(commands_, {}), std::exchange(view_, std::nullopt)};
}

void GazeRunner::Tell(bool changed) {
  const std::shared_ptr<const GazeSnapshot> state = loop_.snapshot();
  untold_ |= changed;
  if (state->time_ns - told_ns_ < (untold_ ? kTellChangeEvery : kTellEvery)) return;
  told_ns_ = state->time_ns;
  untold_ = false;
  publish_(state);
}

void GazeRunner::Run(std::stop_token stop) {
  auto next = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    Work work = WaitFor(next, stop);
    if (work.view) loop_.OnView(*work.view);
    for (const Arrived& one : work.commands) loop_.Execute(one.command, one.time_ns);
    bool changed = std::any_of(work.commands.begin(), work.commands.end(), [](const Arrived& one) {
      // Whether the lease changed hands is in the handovers; places in the queue can wait.
      return !std::holds_alternative<AcquireGazeLease>(one.command);
    });
    // A command acts at once, not at the next step.
    if (!work.commands.empty() || std::chrono::steady_clock::now() >= next) {
      loop_.Step(MonotonicNow());
      next = std::chrono::steady_clock::now() + kStep;
    }
    for (const Handover& change : loop_.TakeHandovers()) {
      Log(absl::StrCat("gaze: ", change.words));
      changed = true;
    }
    Tell(changed);
  }
}

}  // namespace saccade
