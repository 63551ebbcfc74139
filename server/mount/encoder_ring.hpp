#pragma once

#include <deque>
#include <optional>

#include "server/mount/mount.hpp"

namespace saccade {

/// The last readings of the encoders, in order of time. Not thread safe.
class EncoderRing {
 public:
  /// `span_ns`: how far back readings are kept. `max_gap_ns`: two readings further apart than this
  /// are not interpolated between, and the newest is not carried on for longer.
  explicit EncoderRing(Timestamp span_ns = 2'000'000'000, Timestamp max_gap_ns = 100'000'000)
      : span_ns_(span_ns), max_gap_ns_(max_gap_ns) {}

  /// Readings that are not newer than the last are dropped: false.
  bool Add(const EncoderReading& reading);
  void Clear() { readings_.clear(); }

  std::optional<EncoderReading> Newest() const;
  /// Linear between the two readings around `time_ns`; past the newest, by the rate of the last
  /// 30 ms. Nothing before the oldest, in a gap, or too far past the newest.
  std::optional<MountAngles> At(Timestamp time_ns) const;
  std::size_t size() const { return readings_.size(); }

 private:
  const Timestamp span_ns_, max_gap_ns_;
  std::deque<EncoderReading> readings_;
};

}  // namespace saccade
