#include "server/tracker/home.hpp"

#include <algorithm>
#include <vector>

namespace saccade {

std::optional<CloneId> WantedHome(const FrameMatches& matches, const FilterState& filter,
                                  CloneId home, const HomeOptions& options) {
  if (options.least_share <= 0.0) return std::nullopt;
  std::vector<CloneId> seen_from;
  for (const LandmarkMatch& match : matches.in_view) {
    if (std::holds_alternative<Eigen::Vector3d>(match.point)) return std::nullopt;
    if (match.accepted() && filter.Has(match.id)) seen_from.push_back(filter.CloneOf(match.id));
  }
  if (seen_from.empty()) return std::nullopt;
  const auto from_home =
      std::count_if(seen_from.begin(), seen_from.end(), [home](CloneId id) { return id <= home; });
  const auto middle = seen_from.begin() + std::ssize(seen_from) / 2;
  std::nth_element(seen_from.begin(), middle, seen_from.end());
  const bool far =
      from_home < options.least_share * static_cast<double>(seen_from.size()) && *middle > home;
  const bool loose = filter.DirectionSigma(*middle) > options.loose_tie_rad;
  return far || loose ? std::optional(*middle) : std::nullopt;
}

}  // namespace saccade
