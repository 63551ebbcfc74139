#pragma once

#include <absl/status/status.h>

#include <cstddef>
#include <string>

#include "server/identity/access.hpp"
#include "server/pipeline/rate_limiter.hpp"

namespace saccade {

/// How many calls and bytes one token and one address may send, whatever is called.
///
/// A busy expert sends up to 200 calls a second (acknowledgements, a stroke that grows, heartbeats)
/// and 3 MB (the whole of a long stroke, 60 times a second). A full bucket is some seconds' worth.
struct TrafficLimits {
  RateLimit token_requests{500, 3000}, address_requests{2000, 10'000};
  RateLimit token_bytes{8e6, 32e6}, address_bytes{32e6, 128e6};
  /// Of all passes that came by one invite together, as of an address: a room full of people.
  RateLimit invite_requests{2000, 10'000}, invite_bytes{32e6, 128e6};
  bool this_machine = false;  // loopback, which may be a proxy, is limited by address, too
};

/// Asked once for each call, before its message is parsed. Thread safe.
///
/// Who has a valid token pays from its own bucket, and from the address's only beyond a little that
/// is its own: who floods from an address does not silence the others there.
class TrafficGate {
 public:
  explicit TrafficGate(const TrafficLimits& limits);

  /// `peer` as PeerKey, `access` of a valid token (without an id: none), `bytes` of the message.
  /// ResourceExhausted says whose limit it is, how much that is, and when to try again.
  absl::Status Admit(const std::string& peer, const Access& access, std::size_t bytes,
                     Timestamp now_ns);

 private:
  const TrafficLimits limits_;
  RateLimiter courtesy_, token_requests_, token_bytes_, address_requests_, address_bytes_;
  RateLimiter invite_requests_, invite_bytes_;
};

}  // namespace saccade
