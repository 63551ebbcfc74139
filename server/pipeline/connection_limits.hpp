#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <string>

#include "server/pipeline/rate_limiter.hpp"

namespace saccade {

/// How many connections one port takes. An office shares an address: some ten pages with up to six
/// connections each are far below.
struct ConnectionLimits {
  int all = 1024;
  int of_address = 256;  // 0: no limit, as of the next two
  int of_network = 512;  // of one NetworkKey: who has many addresses side by side
  // Of these, who has not said anything whole yet: half a handshake, half a request.
  int unheard_of_address = 64;
  RateLimit new_of_address{50, 300};  // handshakes, mostly: half a millisecond of a core each
  bool this_machine = false;          // loopback, which may be a proxy, is counted by address, too
  std::string trusted_proxy;          // nor is this one (PlainAddress); empty: none
};

/// What is open at a port now.
struct ConnectionCounts {
  int all = 0, of_address = 0, unheard_of_address = 0, of_network = 0;
};

/// Decides about connections before a byte of them is read. One thread.
class ConnectionGate {
 public:
  explicit ConnectionGate(const ConnectionLimits& limits)
      : limits_(limits), new_(limits.new_of_address) {}

  /// The proxy that carries many people's calls: nothing below is asked of it.
  bool IsProxy(absl::string_view address) const;
  /// To be asked first, as it costs least: ResourceExhausted (with the time to try again).
  absl::Status Hurry(const std::string& peer, Timestamp now_ns);
  /// Then this; `all` is the caller's to judge, who may have something to close.
  absl::Status Admit(const std::string& peer, const ConnectionCounts& counts) const;
  /// Whether `peer` is counted at all.
  bool Counts(const std::string& peer) const;

 private:
  const ConnectionLimits limits_;
  RateLimiter new_;
};

}  // namespace saccade
