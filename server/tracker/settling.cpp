#include "server/tracker/settling.hpp"

#include <algorithm>

#include "server/tracker/depth_knowledge.hpp"

namespace saccade {

bool HasSettled(const FrameMatches& matches, const FilterState& filter, std::int64_t frames,
                const SettlingOptions& options) {
  if (frames >= options.longest_frames) return true;
  const auto known = [&filter](const LandmarkMatch& match) {
    return match.accepted() && filter.Has(match.id) &&
           KnownTo(filter.Marginal(match.id), DepthKnowledge::kSettled);
  };
  return std::count_if(matches.in_view.begin(), matches.in_view.end(), known) >=
         options.known_features;
}

}  // namespace saccade
