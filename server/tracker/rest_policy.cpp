#include "server/tracker/rest_policy.hpp"

#include "server/tracker/depth_knowledge.hpp"

namespace saccade {

bool RestPolicy::FailsProbation(const Landmark& landmark) const {
  return landmark.woken && landmark.woken->attempted >= options_.probation &&
         landmark.woken->attempted < 4 * options_.probation &&
         4 * landmark.woken->matched < landmark.woken->attempted;
}

int RestPolicy::Failures(const Landmark& landmark) const {
  if (!landmark.woken) return 0;
  return landmark.woken->failures + (FailsProbation(landmark) ? 1 : 0);
}

bool RestPolicy::MayRest(const Landmark& landmark, const Map& map,
                         const FilterState& filter) const {
  if (!wake_ || landmark.known || landmark.matched < options_.mature ||
      Failures(landmark) >= options_.most_failures || !filter.Has(landmark.id) ||
      !map.Recall(landmark.id)) {
    return false;
  }
  return KnownTo(filter.Marginal(landmark.id),
                 landmark.seeded ? DepthKnowledge::kSeededToRest : DepthKnowledge::kToRest);
}

bool RestPolicy::HasMovedFrom(const Landmark& landmark, const MapMoment& now, const Map& map,
                              const FilterState& filter) const {
  const auto recalled = map.Recall(landmark.id);
  if (!recalled) return false;
  const Eigen::Vector3d way =
      filter.camera().world_from_camera.translation - recalled->world_from_anchor.translation;
  return way.norm() * now.inverse_range > options_.moved_share;
}

std::optional<RestNote> RestPolicy::Judge(const Landmark& landmark, const MapMoment& now,
                                          const Map& map, const FilterState& filter) const {
  if (!MayRest(landmark, map, filter)) return std::nullopt;
  // What was woken in vain has taught the filter nothing.
  const bool failed = FailsProbation(landmark);
  return RestNote{.home = now.home,
                  .rests_until = failed ? now.frame + options_.pause : 0,
                  .failures = Failures(landmark),
                  .learnt = !failed};
}

}  // namespace saccade
