#include "server/anchors/anchor_claim.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr double kWakeAngle_rad = 0.01;
constexpr double kSeenBy_s = 4.0;  // an outline that can be seen has been by then

/// Adds the variance of an error along `line_in_world`, which is one sigma long.
void AddAlong(const MapView& map, const Eigen::Vector3d& line_in_world, PlaceEstimate& estimate) {
  const Eigen::Vector3d in_camera =
      map.snapshot().world_from_camera.rotation.conjugate() * line_in_world;
  estimate.covariance_in_world += line_in_world * line_in_world.transpose();
  estimate.covariance_in_camera += in_camera * in_camera.transpose();
}

}  // namespace

Eigen::Matrix3d PoseCovarianceAt(const MapSnapshot& snapshot, const Eigen::Vector3d& point) {
  const Eigen::Matrix3d camera_from_world = snapshot.world_from_camera.RotationMatrix().transpose();
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian.leftCols<3>() = -camera_from_world;
  jacobian.rightCols<3>() = Skew(snapshot.world_from_camera.Inverse() * point);
  return jacobian * snapshot.pose_covariance * jacobian.transpose();
}

Eigen::Matrix3d RestCovarianceAt(const MapSnapshot& snapshot, const Eigen::Vector3d& point,
                                 double turn_variance) {
  const Eigen::Matrix3d turn = Skew(snapshot.world_from_camera.Inverse() * point);
  return PoseCovarianceAt(snapshot, point) + turn_variance * turn * turn.transpose();
}

double TurnVariance(const MapSnapshot& snapshot, const FeatureSnapshot& feature) {
  const double distance2 =
      (feature.point_in_world - snapshot.world_from_camera.translation).squaredNorm();
  const double least = feature.covariance_in_world.diagonal().minCoeff();
  return std::min(kWakeAngle_rad * kWakeAngle_rad, least / std::max(1e-9, distance2));
}

bool IsAtRest(const FeatureSnapshot& feature) {
  const double in_world = feature.covariance_in_world.trace();
  return feature.state == FeatureState::kNotAttempted && !feature.pixel && in_world > 0 &&
         std::abs(feature.covariance_in_camera.trace() - in_world) < 1e-6 * in_world;
}

void AddScale(const MapView& map, const AnchorPlace& place, PlaceEstimate& estimate) {
  double total = 0, variance = 0;
  for (const ClusterMember& member : place.members) {
    total += member.weight;
    variance += member.weight * map.ScaleVariance(member.id);
  }
  if (!(total > 0)) return;
  const double sigma = std::sqrt(variance / total);
  const Eigen::Vector3d line =
      estimate.point_in_world - map.snapshot().world_from_camera.translation;
  estimate.scale_sigma_m = sigma * line.norm();
  AddAlong(map, sigma * line, estimate);
}

void AddDoubt(const MapView& map, const AnchorPlace& place, PlaceEstimate& estimate) {
  if (place.doubt_ray.isZero(0.0)) return;
  const double range_m = place.doubt_ray.dot(place.point - place.clicked_from);
  const double sigma_m = place.doubt.Sigma(range_m, place.seed_covariance.has_value());
  if (place.doubt.surface == ClickSurface::kOutline) estimate.outline_sigma_m = sigma_m;
  AddAlong(map, sigma_m * (place.world_from_binding.rotation * place.doubt_ray), estimate);
}

void NoteSure(const MapView& map, const AnchorOptions& options, const PlaceEstimate& estimate,
              AnchorPlace& place) {
  const MapSnapshot& snapshot = map.snapshot();
  if (place.was_sure || snapshot.status != TrackingStatus::kTracking) return;
  const double limit_m = PauseLimit(snapshot, options, place);
  place.was_sure = estimate.covariance_in_camera.trace() < limit_m * limit_m;
}

double PauseLimit(const MapSnapshot& snapshot, const AnchorOptions& options,
                  const AnchorPlace& place) {
  if (!snapshot.metric) return options.pause_sigma_no_scale * place.distance_m;
  return std::max(options.pause_sigma_m, options.pause_sigma_relative * place.distance_m);
}

bool AwaitsLook(const MapView& map, const AnchorPlace& place) {
  return place.look && Seconds(map.snapshot().capture_time_ns - place.placed_ns) < kSeenBy_s;
}

}  // namespace saccade
