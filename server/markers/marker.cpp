#include "server/markers/marker.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <map>
#include <utility>

namespace saccade {

double ShortestSide(const MarkerSighting& sighting) {
  double least = (sighting.corners[3] - sighting.corners[0]).norm();
  for (int k = 0; k < 3; ++k) {
    least = std::min(least, (sighting.corners[k + 1] - sighting.corners[k]).norm());
  }
  return least;
}

Eigen::Vector2d Middle(const MarkerSighting& sighting) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : sighting.corners) sum += corner;
  return sum / 4;
}

std::vector<MarkerDrop> DropRepeated(std::vector<MarkerSighting>& sightings) {
  std::map<std::pair<std::string, int>, int> count;
  for (const MarkerSighting& sighting : sightings) ++count[{sighting.family, sighting.id}];
  std::vector<MarkerDrop> dropped;
  std::erase_if(sightings, [&](const MarkerSighting& sighting) {
    const int times = count.at({sighting.family, sighting.id});
    if (times < 2) return false;
    dropped.push_back({sighting.family, sighting.id, Middle(sighting),
                       absl::StrCat("there are ", times,
                                    " with this id in the picture; give each "
                                    "square an id of its own")});
    return true;
  });
  return dropped;
}

}  // namespace saccade
