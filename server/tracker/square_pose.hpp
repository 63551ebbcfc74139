#pragma once

#include <optional>
#include <vector>

#include "server/features/pose_fit.hpp"
#include "server/markers/marker.hpp"
#include "server/markers/square_map.hpp"

namespace saccade {

/// Where a camera is that sees one square: the two poses of a flat thing, refined through the lens.
struct SquarePose {
  Rigid3 square_from_camera;
  Rigid3 other;        // its mirror; the same if there is none
  double ratio = 1.0;  // of their residuals, the other's by this one's
  double rms_px = 0.0;
  Matrix6d covariance = Matrix6d::Zero();  // [position in square, rotation (local)]

  /// True if the pictures tell the two apart (slam-spec 7).
  bool sure() const { return ratio > 2.0; }
};

/// Nothing if the corners are those of no square.
std::optional<SquarePose> PoseOfSquare(const CameraModel& camera, const MarkerSighting& sighting,
                                       double side_m);

/// Where a camera is that sees known squares. Two squares or more tell; of one its pose must be
/// sure. Squares that do not agree with the most are left out.
struct SquaresPose {
  PoseFit fit;
  int squares = 0;  // that agree
};
std::optional<SquaresPose> PoseOfSquares(const CameraModel& camera,
                                         const std::vector<MarkerSighting>& sightings,
                                         const SquareMap& map);

}  // namespace saccade
