#pragma once

#include <algorithm>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// One view's requests for a key frame, joined: it serves all who ask, and costs all who watch
/// several times a picture. Who joins is served at once; where many lose pictures again and again
/// there is one a second. Not thread safe.
class KeyFrameRequests {
 public:
  void Ask() { asked_ = true; }
  /// One was coded: whoever asked before has it.
  void Made() { asked_ = false; }

  /// True if the encoder is to be asked now.
  bool Grant(Timestamp now_ns) {
    tokens_ = std::min(kBurst, tokens_ + kPerS * Seconds(now_ns - filled_ns_));
    filled_ns_ = now_ns;
    if (!asked_ || tokens_ < 1.0 || now_ns - granted_ns_ < kApartNs) return false;
    tokens_ -= 1.0;
    granted_ns_ = now_ns;
    asked_ = false;
    return true;
  }

 private:
  static constexpr double kBurst = 4.0, kPerS = 1.0;
  static constexpr Timestamp kApartNs = 250'000'000;

  bool asked_ = false;
  double tokens_ = kBurst;
  Timestamp filled_ns_ = 0, granted_ns_ = -kApartNs;
};

}  // namespace saccade
