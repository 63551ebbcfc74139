#include "server/app/shutdown.hpp"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <thread>
#include <utility>

#include "shared/io/log.hpp"

namespace saccade {
namespace {

using Clock = std::chrono::steady_clock;

// Together below two seconds.
constexpr std::chrono::milliseconds kGrace(1200);
constexpr std::chrono::milliseconds kCommit(400);
constexpr std::chrono::milliseconds kCommitAtOnce(50);
constexpr std::chrono::milliseconds kLastWords(100);

timespec ToTimespec(Clock::duration duration) {
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
  timespec out{};
  out.tv_sec = ns / 1'000'000'000;
  out.tv_nsec = ns % 1'000'000'000;
  return out;
}

}  // namespace

Shutdown& Shutdown::Listen() {
  static Shutdown* const shutdown = new Shutdown();  // outlives every thread
  return *shutdown;
}

Shutdown::Shutdown() {
  sigemptyset(&signals_);
  for (const int number : {SIGINT, SIGTERM}) {
    sigaddset(&signals_, number);
    signal(number, SIG_DFL);  // a shell starts what is in the background deaf to SIGINT
  }
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  signal(SIGPIPE, SIG_IGN);
  std::thread([this] { Run(); }).detach();
}

void Shutdown::Run() {
  int got = 0;
  sigwait(&signals_, &got);
  {
    const std::lock_guard lock(mutex_);
    requested_ = true;
  }
  changed_.notify_all();
  const Clock::time_point end = Clock::now() + kGrace;
  for (Clock::time_point now = Clock::now(); now < end; now = Clock::now()) {
    const timespec rest = ToTimespec(end - now);
    if (sigtimedwait(&signals_, nullptr, &rest) > 0) {
      Leave("left at once, on a second signal", kCommitAtOnce);
    }
  }
  Leave("left without waiting", kCommit);
}

void Shutdown::Leave(const char* why, std::chrono::milliseconds commit_limit) {
  absl::Status committed;
  {
    const std::lock_guard lock(commit_mutex_);
    if (commit_) committed = commit_(commit_limit);
  }
  Log(absl::StrCat("saccade-server: ", why, " for: ", phase_.load(), "; ",
                   committed.ok() ? "every accepted change is on disk"
                                  : absl::StrCat("changes that were not answered yet may be lost (",
                                                 committed.message(), ")")));
  FlushLog(kLastWords);
  _exit(committed.ok() ? 0 : 1);
}

void Shutdown::Wait(const std::optional<double>& run_for_s) {
  std::unique_lock lock(mutex_);
  const auto asked = [this] { return requested_; };
  if (!run_for_s) return changed_.wait(lock, asked);
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(*run_for_s));
  if (changed_.wait_until(lock, end, asked)) return;
  kill(getpid(), SIGTERM);  // the end in order is the same, and may need the same push
  changed_.wait(lock, asked);
}

bool Shutdown::requested() const {
  const std::lock_guard lock(mutex_);
  return requested_;
}

void Shutdown::SetCommit(Commit commit) {
  const std::lock_guard lock(commit_mutex_);
  commit_ = std::move(commit);
}

}  // namespace saccade
