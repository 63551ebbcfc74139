#include "server/map/landmark.hpp"

#include <algorithm>

namespace saccade {

void LandmarkMap::Add(Landmark landmark) {
  const auto behind =
      std::upper_bound(landmarks_.begin(), landmarks_.end(), landmark.id,
                       [](FeatureId id, const Landmark& each) { return id < each.id; });
  landmarks_.insert(behind, std::move(landmark));
}

void LandmarkMap::Remove(std::span<const FeatureId> ids) {
  std::erase_if(landmarks_, [&](const Landmark& landmark) {
    return std::find(ids.begin(), ids.end(), landmark.id) != ids.end();
  });
}

const Landmark* LandmarkMap::Find(FeatureId id) const {
  const auto at =
      std::lower_bound(landmarks_.begin(), landmarks_.end(), id,
                       [](const Landmark& landmark, FeatureId key) { return landmark.id < key; });
  return at != landmarks_.end() && at->id == id ? &*at : nullptr;
}

Landmark* LandmarkMap::Find(FeatureId id) {
  return const_cast<Landmark*>(std::as_const(*this).Find(id));
}

std::vector<FeatureId> Unreliable(const LandmarkMap& map, const RetirementOptions& options) {
  std::vector<FeatureId> ids;
  for (const Landmark& landmark : map.all()) {
    if (landmark.known) continue;
    const std::uint32_t patience = landmark.seeded ? 2 : 1;
    if (landmark.matched >= options.mature_after) {
      if (landmark.failed_in_row >= patience * options.mature_failures) ids.push_back(landmark.id);
    } else if (landmark.attempted >= patience * options.min_attempts &&
               landmark.matched < options.min_success * landmark.attempted) {
      ids.push_back(landmark.id);
    }
  }
  return ids;
}

std::vector<FeatureId> LeastWorth(const LandmarkMap& map, int count, std::int64_t frame) {
  constexpr std::int64_t kLately = 30;  // frames
  struct Worth {
    bool lately;
    std::uint32_t matched;
    FeatureId id;
  };
  std::vector<Worth> order;
  for (const Landmark& landmark : map.all()) {
    if (landmark.known || landmark.seeded) continue;
    const bool lately = landmark.last_matched_frame >= frame - kLately;
    order.push_back({lately, landmark.matched, landmark.id});
  }
  std::sort(order.begin(), order.end(), [](const Worth& a, const Worth& b) {
    if (a.lately != b.lately) return !a.lately;
    return a.matched != b.matched ? a.matched < b.matched : a.id < b.id;
  });
  std::vector<FeatureId> ids;
  for (int k = 0; k < count && k < static_cast<int>(order.size()); ++k) ids.push_back(order[k].id);
  return ids;
}

}  // namespace saccade
