#pragma once

#include "server/anchors/anchor_place.hpp"

namespace saccade {

/// What lies between two places.
struct Measured {
  Eigen::Vector3d offset_in_world = Eigen::Vector3d::Zero();  // from the first to the second [m]
  double length_m = 0;
  double sigma_m = 0;
};

/// Standard deviation of the distance between two points with these covariances, to first order;
/// `shared`: covariance of the first's error with the second's (row: first) [m^2]. Worked number:
/// 3 mm along the line each, nothing shared, give 4.24 mm. Of points that coincide, the largest of
/// any direction.
double LengthSigma(const Eigen::Vector3d& offset_in_world, const Eigen::Matrix3d& first,
                   const Eigen::Matrix3d& second, const Eigen::Matrix3d& shared);

/// The distance between two places as Follow estimated them in one frame. Errors that both have
/// count once: of landmarks that carry both, and of the scale of that part of the map. What else
/// they may share (the camera's own error) is taken as if they did not.
Measured MeasureBetween(const MapView& map, const AnchorPlace& first, const PlaceEstimate& at_first,
                        const AnchorPlace& second, const PlaceEstimate& at_second);

/// The anchor of a measure as one sees it: the worse of its two ends.
Anchor JoinEnds(const Anchor& first, const Anchor& second);

}  // namespace saccade
