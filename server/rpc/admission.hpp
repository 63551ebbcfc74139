#pragma once

#include <absl/status/status.h>

#include <array>
#include <memory>
#include <string>

#include "server/rpc/rate_limiter.hpp"

namespace saccade {

/// Kinds of calls, by what they cost.
enum class Toll { kJoin, kEdit, kReset, kStill, kGaze, kRead };
inline constexpr int kTolls = 6;

/// How often each kind may be called by one address, by one session, and by all together.
///
/// Many experts may share an address (an office, a tunnel), so an address may do what a room full
/// of people does. Chosen well above what people and scripts do, well below what hurts the tracker.
struct RpcLimits {
  struct Kind {
    RateLimit peer, session, server;
  };
  Kind join{{20, 1000}, {}, {50, 1000}};
  Kind edit{{400, 2000}, {100, 1000}, {}};  // a stroke that grows while it is drawn: 60 a second
  Kind reset{{}, {0.2, 3}, {0.5, 6}};       // each throws the map away
  Kind still{{10, 30}, {}, {20, 40}};       // 10 to 20 ms of a core each
  Kind gaze{{400, 800}, {60, 120}, {}};     // heartbeats: up to 20 a second
  Kind read{{100, 500}, {}, {}};            // up to a megabyte each

  const Kind& of(Toll toll) const;
};

/// Refuses what comes too often. Thread safe.
class Admission {
 public:
  explicit Admission(const RpcLimits& limits);

  /// Takes the toll of one call by `peer`; then, where there is one, of `participant_id`.
  /// ResourceExhausted says whose limit it is and when to try again.
  absl::Status Peer(Toll toll, const std::string& peer, Timestamp now_ns);
  absl::Status Session(Toll toll, const std::string& participant_id, Timestamp now_ns);

 private:
  struct Limiters {
    explicit Limiters(const RpcLimits::Kind& kind)
        : peer(kind.peer), session(kind.session), server(kind.server, 1) {}
    RateLimiter peer, session, server;
  };
  std::array<std::unique_ptr<Limiters>, kTolls> limiters_;
};

}  // namespace saccade
