#include "server/anchors/anchor_state.hpp"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

double LargestSigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(2)));
}

void DescribePixel(const MapView& map, const CameraModel& camera, const PlaceEstimate& estimate,
                   Anchor& anchor) {
  const Eigen::Vector3d in_camera =
      map.snapshot().world_from_camera.Inverse() * estimate.point_in_world;
  Eigen::Matrix<double, 2, 3> jacobian;
  const std::optional<Eigen::Vector2d> pixel = camera.Project(in_camera, &jacobian);
  if (!pixel || !camera.InImage(*pixel, -0.5)) return;
  const Eigen::Matrix2d s = jacobian * estimate.covariance_in_camera * jacobian.transpose();
  const double middle = 0.5 * s.trace();
  const double spread = std::hypot(0.5 * (s(0, 0) - s(1, 1)), s(0, 1));
  anchor.pixel = pixel;
  anchor.error_px = std::sqrt(std::max(0.0, middle + spread));
}

double PauseLimit(const MapSnapshot& snapshot, const AnchorOptions& options,
                  const AnchorPlace& place) {
  if (!snapshot.metric) return 0.05 * place.distance_m;  // no metres to speak of
  return std::max(options.pause_sigma_m, options.pause_sigma_relative * place.distance_m);
}

/// True once a member is near enough to vouch for the place (after a restart the map grows back).
bool HasNearMember(const AnchorPlace& place) {
  const auto near = [&place](const ClusterMember& member) {
    return (member.at_binding - place.point).norm() < std::max(0.5, 0.5 * place.distance_m);
  };
  return std::any_of(place.members.begin(), place.members.end(), near);
}

/// One word on what is wrong with the tracker itself; empty if nothing.
std::string TrackerTrouble(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kInitialising:
      return "the map is starting: move the camera sideways";
    case TrackingStatus::kLost:
      return "tracking is lost: show a place seen before";
    case TrackingStatus::kRelocalising:
      return "tracking is being recovered";
    default:
      return "";
  }
}

}  // namespace

Anchor DescribeAnchor(const MapView& map, const CameraModel& camera, const AnchorOptions& options,
                      const PlaceEstimate& estimate, AnchorPlace& place) {
  const MapSnapshot& snapshot = map.snapshot();
  Anchor anchor;
  anchor.method = place.method;
  anchor.point_in_world = estimate.point_in_world;
  anchor.covariance_in_world = estimate.covariance_in_world;
  anchor.error_m = LargestSigma(estimate.covariance_in_camera);
  DescribePixel(map, camera, estimate, anchor);

  const double limit_m = PauseLimit(snapshot, options, place);
  const double share = place.paused ? options.resume_share : 1.0;
  const bool too_far_off = anchor.error_m > share * limit_m;
  const bool too_many_px = anchor.error_px && *anchor.error_px > share * options.pause_sigma_px;
  const double relative = anchor.error_m / place.distance_m;
  const std::string trouble = TrackerTrouble(snapshot.status);
  if (!place.was_tracking && trouble.empty()) {
    place.was_tracking =
        relative < options.tracking_sigma && !too_far_off && !too_many_px && HasNearMember(place);
  }
  place.paused = place.was_tracking && (too_far_off || too_many_px);

  if (!trouble.empty()) {
    anchor.state = AnchorState::kPaused;
    anchor.reason = trouble;
  } else if (!place.was_tracking) {
    anchor.state = AnchorState::kProvisional;
    anchor.reason = HasNearMember(place)
                        ? absl::StrFormat("its depth is known to %.0f %%: move the camera sideways",
                                          100.0 * relative)
                        : "no mapped feature is near it yet: look around there";
  } else if (place.paused) {
    anchor.state = AnchorState::kPaused;
    anchor.reason = too_far_off ? absl::StrFormat("expected error %.0f mm is above %.0f mm",
                                                  1e3 * anchor.error_m, 1e3 * limit_m)
                                : absl::StrFormat("expected error %.0f px is above %.0f px",
                                                  *anchor.error_px, options.pause_sigma_px);
  } else {
    anchor.state = AnchorState::kTracking;
  }
  return anchor;
}

Anchor DescribeDetached(const MapSnapshot& snapshot, const AnchorOptions& options,
                        const AnchorPlace& place, Anchor last) {
  last.state = AnchorState::kPaused;
  last.place_known = false;
  last.error_px.reset();
  last.pixel.reset();
  if (place.world_key.empty() || place.world_key != options.world_key) {
    last.reason = "its place is not known in this map: it was placed in another one; move it";
  } else if (!snapshot.metric) {
    last.reason = "its place is not known in this map yet: show the target";
  } else {
    last.reason = "its place is not known in this map yet: " + TrackerTrouble(snapshot.status);
  }
  return last;
}

}  // namespace saccade
