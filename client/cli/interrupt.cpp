#include "client/cli/interrupt.hpp"

#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

namespace saccade::cli {
namespace {

constexpr int kInterrupted = 130;
volatile sig_atomic_t interrupted = 0;

// Both are handlers: nothing in them but what a handler may call.
void OnLate(int /*signal*/) { _exit(kInterrupted); }

void OnInterrupt(int /*signal*/) {
  if (interrupted != 0) _exit(kInterrupted);
  interrupted = 1;
  const itimerval grace = {.it_interval = {}, .it_value = {.tv_sec = 1, .tv_usec = 500'000}};
  setitimer(ITIMER_REAL, &grace, nullptr);
}

}  // namespace

void HearInterrupts() {
  signal(SIGALRM, OnLate);
  signal(SIGINT, OnInterrupt);
  signal(SIGTERM, OnInterrupt);
}

bool Interrupted() { return interrupted != 0; }

}  // namespace saccade::cli
