#pragma once

#include "server/map/map.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade {

/// Where the tracker is when it looks after its landmarks.
struct MapMoment {
  std::int64_t frame = 0;
  CloneId home = 0;            // clone that errors are counted from
  double inverse_range = 1.0;  // [1/m] typical, of what is in view
};

struct RestOptions {
  std::uint32_t mature = 15;    // matches
  double moved_share = 0.1;     // of the distance to what is in view
  std::uint32_t probation = 8;  // attempts that a woken landmark has
  int most_failures = 3;        // times that it was woken in vain
  std::int64_t pause = 150;     // frames that one rests which was woken in vain
};

/// Which landmarks may leave the filter to be woken one day (docs/derivations/rest-and-wake.md).
class RestPolicy {
 public:
  explicit RestPolicy(const TrackerOptions& options, const RestOptions& rest = {})
      : wake_(options.wake), options_(rest) {}

  /// Whether a feature is known well enough to be found again.
  bool MayRest(const Landmark& landmark, const Map& map, const FilterState& filter) const;
  /// Whether the camera is elsewhere than where it saw the landmark first. One that only turns
  /// keeps what it has: a pose that is woken could be anywhere within a percent of the distance,
  /// and as much parallax would be invented.
  bool HasMovedFrom(const Landmark& landmark, const MapMoment& now, const Map& map,
                    const FilterState& filter) const;
  /// A woken landmark that is hardly ever found where it was thought to be.
  bool FailsProbation(const Landmark& landmark) const;
  /// How it rests; nothing: it may not, and is forgotten.
  std::optional<RestNote> Judge(const Landmark& landmark, const MapMoment& now, const Map& map,
                                const FilterState& filter) const;

 private:
  /// How often it was woken in vain.
  int Failures(const Landmark& landmark) const;

  bool wake_;
  RestOptions options_;
};

}  // namespace saccade
