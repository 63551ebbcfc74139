#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// One speaker's packets between the network and the ear: in order, evenly, as late as the network
/// is uneven and no later (20 to 240 ms). Not thread safe.
class JitterBuffer {
 public:
  struct Step {
    enum class Kind { kNothing, kPacket, kMissing };
    Kind kind = Kind::kNothing;
    std::string opus;  // of kPacket
  };

  void Push(std::uint64_t sequence, std::string opus, Timestamp arrived_ns);
  /// What the next 20 ms are. kMissing: a packet that did not come; kNothing: nobody speaks.
  Step Pull();

  double delay_ms() const { return target_ms_; }
  std::int64_t late() const { return late_; }

 private:
  void Learn(double transit_ms);
  void CatchUp();
  double waiting_ms() const;

  std::map<std::uint64_t, std::string> packets_;
  std::deque<double> transits_ms_;
  bool playing_ = false;
  std::uint64_t next_ = 0;
  int missing_ = 0;  // in a row
  int surplus_ = 0;  // steps in a row with more waiting than is needed
  double target_ms_ = 40.0;
  std::int64_t late_ = 0;
};

}  // namespace saccade
