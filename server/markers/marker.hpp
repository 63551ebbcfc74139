#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>
#include <vector>

namespace saccade {

/// A square marker found in a picture. Pixel (0, 0) is the centre of the top-left pixel.
struct MarkerSighting {
  std::string family;  // "apriltag36h11", "aruco_6x6_250", ...
  int id = 0;
  /// Of its black border. In the order of the family's makers: AprilTags counter-clockwise from the
  /// tag's own bottom left, whoever found them; all others clockwise from its top left [px].
  std::array<Eigen::Vector2d, 4> corners;
  /// Of each corner along an axis, half the trace of its covariance: an error's square over this is
  /// two on the average [px^2].
  std::array<double, 4> variance_px2{};
  int corrected_bits = 0;  // of its code
};

/// What looked like a marker and is not given, with the reason in words for a person.
struct MarkerDrop {
  std::string family;
  int id = -1;             // -1: not read
  Eigen::Vector2d middle;  // [px]
  std::string reason;
};

/// Length of its shortest side [px].
double ShortestSide(const MarkerSighting& sighting);
/// Mean of its corners [px].
Eigen::Vector2d Middle(const MarkerSighting& sighting);

/// Takes out those whose family and id are there more than once: which is the one on the wall
/// cannot be told. What was taken out, one a sighting.
std::vector<MarkerDrop> DropRepeated(std::vector<MarkerSighting>& sightings);

}  // namespace saccade
