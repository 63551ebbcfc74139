#include "client/session/latency.hpp"

#include <algorithm>
#include <vector>

namespace saccade::session {
namespace {

constexpr std::size_t kFrames = 90;
constexpr Timestamp kWindowNs = 2'000'000'000, kLeastNs = 300'000'000;

double Ms(Timestamp ns) { return 1e-6 * static_cast<double>(ns); }

}  // namespace

std::optional<StageTimes> TimesOf(const net::FrameFacts& facts, Timestamp decoded_ns,
                                  Timestamp shown_ns, std::optional<Timestamp> offset_ns) {
  const auto& [captured, received, tracked, encoded] = facts.stages;
  if (!offset_ns || captured == 0 || encoded == 0) return std::nullopt;
  const Timestamp after_track = tracked == 0 ? received : tracked;
  return StageTimes{Ms(received - captured),
                    Ms(after_track - received),
                    Ms(encoded - after_track),
                    Ms(facts.arrived_ns + *offset_ns - encoded),
                    Ms(decoded_ns - facts.arrived_ns),
                    Ms(shown_ns - decoded_ns),
                    Ms(shown_ns + *offset_ns - captured)};
}

void LatencyMeter::Add(const StageTimes& times) {
  times_.push_back(times);
  if (times_.size() > kFrames) times_.pop_front();
}

std::optional<LatencyMeter::Percentiles> LatencyMeter::Get(Stage stage) const {
  if (times_.empty()) return std::nullopt;
  std::vector<double> sorted;
  for (const StageTimes& times : times_) sorted.push_back(times[static_cast<std::size_t>(stage)]);
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&sorted](double share) {
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  };
  return Percentiles{at(0.5), at(0.95)};
}

void RateMeter::Add(Timestamp now_ns) { stamps_.push_back(now_ns); }

double RateMeter::Rate(Timestamp now_ns) {
  while (!stamps_.empty() && now_ns - stamps_.front() > kWindowNs) stamps_.pop_front();
  const Timestamp span = stamps_.empty() ? 0 : now_ns - stamps_.front();
  return span < kLeastNs ? 0.0 : static_cast<double>(stamps_.size() - 1) / Seconds(span);
}

}  // namespace saccade::session
