#pragma once

#include "server/anchors/anchor_place.hpp"

namespace saccade {

/// Covariance of a fixed world point seen from the camera, from the pose alone [m^2].
Eigen::Matrix3d PoseCovarianceAt(const MapSnapshot& snapshot, const Eigen::Vector3d& point);

/// The same of a point that landmarks at rest carry: what is in view does not tell how the camera
/// is turned against them, either. `turn_variance` of TurnVariance.
Eigen::Matrix3d RestCovarianceAt(const MapSnapshot& snapshot, const Eigen::Vector3d& point,
                                 double turn_variance);

/// Whether the filter does not hold it: seen from the camera it is as well known as in world, but
/// for the turn.
bool IsAtRest(const FeatureSnapshot& feature);

/// Variance of how the camera is turned against a landmark at rest [rad^2]: where its place is
/// known to a share of the distance its direction is no better, up to what the tracker takes it to
/// be when it wakes it (`wake_angle_sigma_rad`).
double TurnVariance(const MapSnapshot& snapshot, const FeatureSnapshot& feature);

/// What a mark's error may be beside what its members and its click say. None of it moves a mark.

/// All of one part of the map may be too near or too far by one factor: nothing in that part, nor
/// how well it fits, tells. Along the line of sight of now.
void AddScale(const MapView& map, const AnchorPlace& place, PlaceEstimate& estimate);

/// The surface that was clicked may not be the one that was taken. Along the clicked ray.
void AddDoubt(const MapView& map, const AnchorPlace& place, PlaceEstimate& estimate);

/// Expected error above which a mark is not to be trusted, in units of the map.
double PauseLimit(const MapSnapshot& snapshot, const AnchorOptions& options,
                  const AnchorPlace& place);

/// Notes whether members and click alone make the place sure: what a mark hangs on then stays, and
/// is not chosen by what else its claim has to cover.
void NoteSure(const MapView& map, const AnchorOptions& options, const PlaceEstimate& estimate,
              AnchorPlace& place);

/// True while it may still be seen whether the click is on an outline.
bool AwaitsLook(const MapView& map, const AnchorPlace& place);

}  // namespace saccade
