#pragma once

#include <signal.h>
#include <time.h>

#include <stop_token>
#include <thread>

#include "server/capture/frame_source.hpp"

namespace saccade {

/// Ends a source in order at SIGINT or SIGTERM: whoever takes pictures from a camera has no other
/// way.
class EndAtSignal {
 public:
  /// Before anything starts a thread.
  EndAtSignal() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, &before_);
  }
  /// Must end before `source` does.
  std::jthread Watch(FrameSource& source) const {
    return std::jthread([signals = signals_, &source](const std::stop_token& stop) {
      constexpr timespec kLook{0, 100'000'000};
      while (!stop.stop_requested()) {
        if (sigtimedwait(&signals, nullptr, &kLook) > 0) source.Stop();
      }
    });
  }

  /// Once the watch has ended, on the thread that made this: from here on the signals end the
  /// program again, as nobody takes them any more.
  void Release() const { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t signals_{}, before_{};
};

}  // namespace saccade
