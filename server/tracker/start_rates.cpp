// The part of StartFinder that tells how fast things move in the picture.
#include <algorithm>

#include "server/tracker/start_finder.hpp"

namespace saccade {

const StartFinder::Seen* StartFinder::Find(const std::vector<Seen>& seen, FeatureId id) {
  const auto at = std::lower_bound(seen.begin(), seen.end(), id,
                                   [](const Seen& each, FeatureId key) { return each.id < key; });
  return at != seen.end() && at->id == id ? &*at : nullptr;
}

StartFinder::Seen* StartFinder::Shot::Find(FeatureId id) {
  const Seen* seen = StartFinder::Find(sightings, id);
  return const_cast<Seen*>(seen != nullptr ? seen : StartFinder::Find(births, id));
}

void StartFinder::TellRates() {
  if (shots_.size() < 2) return;
  Shot& now = shots_[shots_.size() - 1];
  Shot& before = shots_[shots_.size() - 2];
  Shot* first = shots_.size() > 2 ? &shots_[shots_.size() - 3] : nullptr;
  const double h1 = Seconds(now.time_ns - before.time_ns);
  const double h0 = first != nullptr ? Seconds(before.time_ns - first->time_ns) : 0.0;
  const auto tell = [](Seen& seen, const Eigen::Vector2d& rate_px_s) {
    seen.ray.d_readout = -seen.d_bearing * (rate_px_s * seen.late);
  };
  for (Seen& last : now.sightings) {
    Seen* middle = before.Find(last.id);
    if (middle == nullptr) continue;
    const Eigen::Vector2d d1 = (last.pixel - middle->pixel) / h1;
    Seen* oldest = first != nullptr ? first->Find(last.id) : nullptr;
    if (oldest == nullptr) {
      tell(last, d1);
      tell(*middle, d1);
      continue;
    }
    // The parabola through the three.
    const Eigen::Vector2d d0 = (middle->pixel - oldest->pixel) / h0;
    const Eigen::Vector2d bend = (d1 - d0) / (h0 + h1);
    tell(last, d1 + h1 * bend);
    tell(*middle, d1 - h1 * bend);
    const bool born = Find(first->births, last.id) == oldest;
    if (born || shots_.size() == 3) tell(*oldest, d0 - h0 * bend);  // the middle of none
  }
}

}  // namespace saccade
