#include "server/tracker/retirement.hpp"

#include <algorithm>

namespace saccade {

void Retirement::Rest(std::span<const FeatureId> ids, const MapMoment& now, Map& map,
                      FilterState& filter) const {
  map.Retire(
      ids, [&](const Landmark& landmark) { return rest_.Judge(landmark, now, map, filter); },
      filter);
  map.LocateAtRest();
}

void Retirement::RemoveUnreliable(Map& map, FilterState& filter,
                                  std::vector<FeatureId>& resting) const {
  std::vector<FeatureId> gone = filter.RemoveBehind();
  for (const FeatureId id : Unreliable(map.in_use(), RetirementOptions())) {
    (map.in_use().Find(id)->woken ? resting : gone).push_back(id);
  }
  filter.Remove(gone);
  map.in_use().Remove(gone);
}

void Retirement::Forget(const MapMoment& now, Map& map, FilterState& filter) const {
  if (options_.forget_after <= 0) return;
  std::vector<FeatureId> gone;
  for (const Landmark& landmark : map.in_use().all()) {
    if (landmark.known || landmark.seeded ||
        landmark.last_in_view_frame >= now.frame - options_.forget_after) {
      continue;
    }
    if (rest_.HasMovedFrom(landmark, now, map, filter) && !rest_.MayRest(landmark, map, filter)) {
      gone.push_back(landmark.id);
    }
  }
  filter.Remove(gone);
  map.in_use().Remove(gone);
}

void Retirement::Apply(const MapMoment& now, Map& map, FilterState& filter) const {
  std::vector<FeatureId> resting;
  RemoveUnreliable(map, filter, resting);
  for (const Landmark& landmark : map.in_use().all()) {
    if (landmark.known) continue;
    const bool out_of_sight =
        options_.rest_after > 0 && landmark.last_in_view_frame < now.frame - options_.rest_after;
    if (rest_.FailsProbation(landmark) ||
        (out_of_sight && rest_.HasMovedFrom(landmark, now, map, filter) &&
         rest_.MayRest(landmark, map, filter))) {
      resting.push_back(landmark.id);
    }
  }
  std::sort(resting.begin(), resting.end());
  resting.erase(std::unique(resting.begin(), resting.end()), resting.end());
  if (!resting.empty()) Rest(resting, now, map, filter);
  Forget(now, map, filter);
  const int excess = static_cast<int>(filter.feature_count()) - options_.max_features;
  if (excess > 0) Rest(LeastWorth(map.in_use(), excess, now.frame), now, map, filter);
}

}  // namespace saccade
