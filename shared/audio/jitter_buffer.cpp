#include "shared/audio/jitter_buffer.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace saccade {
namespace {

constexpr double kFrame_ms = 20.0;
constexpr double kLeast_ms = 20.0, kMost_ms = 240.0;
constexpr std::size_t kRemembered = 150;  // arrivals, 3 s
constexpr double kShare = 0.97;           // of them that are to be there in time
constexpr double kMargin_ms = 10.0;
constexpr std::size_t kMostPackets = 24;       // a speaker's stream is bounded whatever he sends
constexpr std::uint64_t kPauseFrames = 5;      // not sent: a silence of the speaker's, not a loss
constexpr std::uint64_t kAnotherFrames = 250;  // so far back is no late one, but a new start
constexpr int kEndFrames = 5;                  // of nothing: the next packet begins anew
constexpr int kCalmFrames = 50;                // 1 s with too much waiting, before one is left out

}  // namespace

double JitterBuffer::waiting_ms() const { return kFrame_ms * static_cast<double>(packets_.size()); }

void JitterBuffer::Push(std::uint64_t sequence, std::string opus, Timestamp arrived_ns) {
  if (playing_ && sequence + kAnotherFrames < next_) {
    packets_.clear();
    transits_ms_.clear();
    playing_ = false;
  }
  Learn(1e-6 * static_cast<double>(arrived_ns) - kFrame_ms * static_cast<double>(sequence));
  if (playing_ && sequence < next_) {
    ++late_;
    return;
  }
  packets_.insert_or_assign(sequence, std::move(opus));
  if (!playing_) {  // the end of what was said before is not said now
    while (packets_.begin()->first + kMostPackets / 2 < sequence) packets_.erase(packets_.begin());
  }
  while (packets_.size() > kMostPackets) packets_.erase(packets_.begin());
}

void JitterBuffer::Learn(double transit_ms) {
  transits_ms_.push_back(transit_ms);
  if (transits_ms_.size() > kRemembered) transits_ms_.pop_front();
  std::vector<double> sorted(transits_ms_.begin(), transits_ms_.end());
  std::sort(sorted.begin(), sorted.end());
  const auto usual = static_cast<std::size_t>(kShare * static_cast<double>(sorted.size() - 1));
  const double spread = sorted[usual] - sorted.front() + kMargin_ms;
  target_ms_ = std::clamp(spread, kLeast_ms, kMost_ms);
}

void JitterBuffer::CatchUp() {
  surplus_ = waiting_ms() > target_ms_ + 2.0 * kFrame_ms ? surplus_ + 1 : 0;
  if (surplus_ < kCalmFrames && waiting_ms() <= target_ms_ + kMost_ms / 2.0) return;
  surplus_ = 0;
  packets_.erase(next_);
  ++next_;
}

JitterBuffer::Step JitterBuffer::Pull() {
  if (!playing_) {
    if (packets_.empty() || waiting_ms() < target_ms_) return {};
    playing_ = true;
    next_ = packets_.begin()->first;
    missing_ = surplus_ = 0;
  } else {
    CatchUp();
  }
  if (const auto found = packets_.find(next_); found != packets_.end()) {
    Step step{Step::Kind::kPacket, std::move(found->second)};
    packets_.erase(found);
    ++next_;
    missing_ = 0;
    return step;
  }
  const bool paused = packets_.empty() || packets_.begin()->first - next_ > kPauseFrames;
  if (paused && ++missing_ >= kEndFrames) {
    playing_ = false;
    return {};
  }
  // Nothing newer either: wait for it, rather than lose it when it comes.
  if (!paused) ++next_;
  return {Step::Kind::kMissing, {}};
}

}  // namespace saccade
