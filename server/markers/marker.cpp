#include "server/markers/marker.hpp"

#include <algorithm>

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

}  // namespace saccade
