#pragma once

#include <span>

#include "server/tracker/rest_policy.hpp"

namespace saccade {

/// Which landmarks leave the filter, and which of them for good (slam-spec 5.6).
class Retirement {
 public:
  explicit Retirement(const TrackerOptions& options) : options_(options), rest_(options) {}

  /// Removes what is unreliable or impossible. What is out of sight and left behind (the camera is
  /// elsewhere than where it saw it first) comes to rest if it would be of use later, and is
  /// forgotten if not; to rest come, too, what was woken in vain and, in a full map, what is worth
  /// least.
  void Apply(const MapMoment& now, Map& map, FilterState& filter) const;

 private:
  void RemoveUnreliable(Map& map, FilterState& filter, std::vector<FeatureId>& resting) const;
  void Forget(const MapMoment& now, Map& map, FilterState& filter) const;
  void Rest(std::span<const FeatureId> ids, const MapMoment& now, Map& map,
            FilterState& filter) const;

  TrackerOptions options_;
  RestPolicy rest_;
};

}  // namespace saccade
