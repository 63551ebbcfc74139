#pragma once

#include <absl/status/status.h>

#include <array>
#include <memory>
#include <string>

#include "server/pipeline/rate_limiter.hpp"

namespace saccade {

/// Kinds of calls, by what they cost.
enum class Toll {
  kJoin,
  kSubscribe,
  kEdit,
  kReset,
  kStill,
  kGaze,
  kRead,
  kRedeem,
  kPoint,
  kPicture,
  kSay,
  kSpeak
};
inline constexpr int kTolls = 12;

/// How often each kind may be called by one session, by one address, and by all together.
///
/// Many experts may share an address (an office, a tunnel), so an address may do what a room full
/// of people does; and each session has a little that is charged to nobody else, so that who floods
/// from an address does not silence the others there. Chosen well above what people and scripts do,
/// well below what hurts the tracker.
struct RpcLimits {
  struct Kind {
    RateLimit courtesy;  // of a session: taken first, and then nothing else is asked
    RateLimit session, peer, server;
  };
  Kind join{{}, {}, {20, 1000}, {50, 1000}};
  Kind subscribe{{}, {1, 10}, {}, {}};
  Kind edit{{5, 20}, {100, 1000}, {400, 2000}, {}};    // a stroke that grows: 60 a second
  Kind reset{{}, {0.2, 3}, {}, {0.5, 6}};              // each throws the map away
  Kind still{{}, {}, {10, 30}, {20, 40}};              // 10 to 20 ms of a core each
  Kind gaze{{10, 20}, {60, 120}, {400, 800}, {}};      // heartbeats: 7 to 20 a second
  Kind read{{}, {}, {100, 500}, {}};                   // up to a megabyte each
  Kind point{{60, 120}, {120, 240}, {600, 1200}, {}};  // 60 a second, and who catches up
  Kind picture{{}, {0.5, 8}, {2, 16}, {4, 32}};        // pinned: up to half a second of a core each
  Kind redeem{{}, {}, {1, 20}, {}};  // of invites, by strangers: nobody else's joins pay for them

  Kind say{{}, {1, 10}, {10, 60}, {20, 100}};         // told to everybody
  Kind speak{{60, 120}, {60, 240}, {600, 2400}, {}};  // a batch each 20 ms
  /// Packets of one speaker, beside what `speak` says of calls: 50 a second are spoken.
  RateLimit voice_packets{75, 150};

  const Kind& of(Toll toll) const;
  /// Every rate and burst times `factor`; 0: no limits, for laboratories.
  RpcLimits Scaled(double factor) const;
};

/// Refuses what comes too often. Thread safe.
class Admission {
 public:
  explicit Admission(const RpcLimits& limits);

  /// Takes the toll of one call that names no session.
  /// ResourceExhausted says whose limit it is and when to try again.
  absl::Status Anyone(Toll toll, const std::string& peer, Timestamp now_ns);
  /// The same of one by a session.
  absl::Status Participant(Toll toll, const std::string& participant_id, const std::string& peer,
                           Timestamp now_ns);

 private:
  struct Limiters {
    explicit Limiters(const RpcLimits::Kind& kind)
        : has_courtesy(kind.courtesy.per_s > 0),
          courtesy(kind.courtesy),
          session(kind.session),
          peer(kind.peer),
          server(kind.server, 1) {}
    const bool has_courtesy;
    RateLimiter courtesy, session, peer, server;
  };
  Limiters& Of(Toll toll) { return *limiters_[static_cast<std::size_t>(toll)]; }

  std::array<std::unique_ptr<Limiters>, kTolls> limiters_;
};

}  // namespace saccade
