#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>

namespace saccade {

/// A square marker found in a picture. Pixel (0, 0) is the centre of the top-left pixel.
struct MarkerSighting {
  std::string family;  // "apriltag36h11", "aruco_6x6_250", ...
  int id = 0;
  /// Of its black border. In the order of the family's makers: AprilTags counter-clockwise from the
  /// tag's own bottom left, whoever found them; all others clockwise from its top left [px].
  std::array<Eigen::Vector2d, 4> corners;
  /// Of each corner, along its worst axis [px^2].
  std::array<double, 4> variance_px2{};
  int corrected_bits = 0;  // of its code
};

/// Length of its shortest side [px].
double ShortestSide(const MarkerSighting& sighting);
/// Mean of its corners [px].
Eigen::Vector2d Middle(const MarkerSighting& sighting);

}  // namespace saccade
