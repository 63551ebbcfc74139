#pragma once

#include <mutex>

#include "server/capture/imu.hpp"

namespace saccade {

/// Samples of a unit that is fixed to a source's camera: all of a recording's, or those that a live
/// one brings. Any thread.
class ImuFeed {
 public:
  explicit ImuFeed(const ImuInfo& info, ImuTrack recorded = {})
      : info_(info), samples_(std::move(recorded)) {}

  const ImuInfo& info() const { return info_; }
  /// Of a live unit; one that is not newer than the last is left out. Keeps the last ten seconds.
  void Add(const ImuSample& sample);
  /// Those of [from, to], one before and one after, where they are there. A live unit's newest
  /// sample stands for what comes within 30 ms after it: pictures do not wait for it.
  ImuTrack Between(Timestamp from_ns, Timestamp to_ns) const;

 private:
  const ImuInfo info_;
  mutable std::mutex mutex_;
  ImuTrack samples_;
  bool live_ = false;
};

}  // namespace saccade
