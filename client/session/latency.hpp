#pragma once

#include <array>
#include <deque>
#include <optional>

#include "client/net/stream.hpp"

namespace saccade::session {

/// Where the time of a picture goes, in this order; the last is the sum.
enum class Stage { kCapture, kTrack, kEncode, kNetwork, kDecode, kDraw, kTotal };
inline constexpr std::size_t kStages = 7;
inline constexpr std::array<const char*, kStages> kStageNames = {
    "capture", "track", "encode", "network", "decode", "draw", "total"};

/// [ms], by stage.
using StageTimes = std::array<double, kStages>;

/// How long one shown frame spent in each stage; nothing without a clock offset or the server's
/// stamps. `decoded_ns`, `shown_ns`: this machine's clock.
std::optional<StageTimes> TimesOf(const net::FrameFacts& facts, Timestamp decoded_ns,
                                  Timestamp shown_ns, std::optional<Timestamp> offset_ns);

/// Percentiles of the last 90 frames, by stage. One thread.
class LatencyMeter {
 public:
  struct Percentiles {
    double p50 = 0, p95 = 0;  // [ms]
  };
  void Add(const StageTimes& times);
  void Clear() { times_.clear(); }
  std::optional<Percentiles> Get(Stage stage) const;

 private:
  std::deque<StageTimes> times_;
};

/// Events a second over the last two seconds. One thread.
class RateMeter {
 public:
  void Add(Timestamp now_ns);
  /// [Hz]; 0 while less than 0.3 s is known.
  double Rate(Timestamp now_ns);

 private:
  std::deque<Timestamp> stamps_;
};

}  // namespace saccade::session
