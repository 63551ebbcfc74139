#include "server/app/gaze_runner.hpp"

#include <absl/strings/str_cat.h>

#include <utility>

#include "server/anchors/edit_checks.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr std::chrono::milliseconds kStep(10);
constexpr Timestamp kTellEvery = 33'000'000;

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
      return absl::ResourceExhaustedError("too many gaze commands are waiting: try again shortly");
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

void GazeRunner::Tell(bool now) {
  const std::shared_ptr<const GazeSnapshot> state = loop_.snapshot();
  if (!now && state->time_ns - told_ns_ < kTellEvery) return;
  told_ns_ = state->time_ns;
  publish_(state);
}

void GazeRunner::Run(std::stop_token stop) {
  auto next = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    Work work = WaitFor(next, stop);
    if (work.view) loop_.OnView(*work.view);
    for (const Arrived& one : work.commands) loop_.Execute(one.command, one.time_ns);
    bool now = !work.commands.empty();
    // A command acts at once, not at the next step.
    if (now || std::chrono::steady_clock::now() >= next) {
      loop_.Step(MonotonicNow());
      next = std::chrono::steady_clock::now() + kStep;
    }
    for (const Handover& change : loop_.TakeHandovers()) {
      Log(absl::StrCat("gaze: ", change.words));
      now = true;
    }
    Tell(now);
  }
}

}  // namespace saccade
