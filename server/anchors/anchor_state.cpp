#include "server/anchors/anchor_state.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "server/anchors/anchor_claim.hpp"
#include "shared/scene/length_text.hpp"

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

/// An expected error, and what it may be.
struct Excess {
  double error = 0, limit = 0;
  bool above = false;
};

/// "56 mm is above 50 mm": two numbers that differ as they are read, with as many digits as that
/// takes.
std::string Compare(double error, double limit, const char* unit, const char* limit_of = "") {
  const char* const word = error > limit ? "above" : "below";
  for (const int digits : {0, 1, 2}) {
    const std::string a = absl::StrFormat("%.*f", digits, error);
    const std::string b = absl::StrFormat("%.*f", digits, limit);
    if (a != b) return absl::StrFormat("%s %s is %s %s %s%s", a, unit, word, b, unit, limit_of);
  }
  return absl::StrFormat("is just %s %g %s%s", word, limit, unit, limit_of);
}

std::string Compare(const Excess& metres, const MapSnapshot& snapshot, const AnchorPlace& place) {
  if (!snapshot.metric) {
    return Compare(1e2 * metres.error / place.distance_m, 1e2 * metres.limit / place.distance_m,
                   "%", " of its distance");
  }
  const std::string error = LengthText(metres.error), limit = LengthText(metres.limit);
  if (error == limit) return Compare(1e3 * metres.error, 1e3 * metres.limit, "mm");
  return absl::StrCat(error, " is ", metres.above ? "above " : "below ", limit);
}

/// Not trusted from the first frame above a limit on; again at once well below it, or after it
/// stayed below for a while. An error that settles just below the limit is one that a mark which
/// was never above it may have, too.
void UpdatePaused(const MapSnapshot& snapshot, const AnchorOptions& options,
                  std::span<const Excess> all, AnchorPlace& place) {
  const auto is_above = [](const Excess& one) { return one.above; };
  const auto is_well_below = [&options](const Excess& one) {
    return one.error <= options.resume_share * one.limit;
  };
  const Timestamp now_ns = snapshot.capture_time_ns;
  if (std::any_of(all.begin(), all.end(), is_above)) {
    place.paused = true;
    place.above_ns = now_ns;
  } else if (place.paused) {
    const bool stayed = std::abs(Seconds(now_ns - place.above_ns)) >= options.resume_time_s;
    place.paused = !stayed && !std::all_of(all.begin(), all.end(), is_well_below);
  }
}

/// True once a member is near enough to vouch for the place (after a restart the map grows back).
bool HasNearMember(const AnchorPlace& place) {
  const auto near = [&place](const ClusterMember& member) {
    return (member.at_binding - place.point).norm() < std::max(0.5, 0.5 * place.distance_m);
  };
  return std::any_of(place.members.begin(), place.members.end(), near);
}

/// What is wrong with the tracker itself, in words; empty if nothing.
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

/// What makes an anchor's depth better known; where nothing can, that it has to be placed again.
std::string Remedy(const AnchorPlace& place, const PlaceEstimate& estimate, double error_m) {
  if (estimate.outline_sigma_m > 0.7 * error_m) {
    return "it is on an outline; place it again beside it";
  }
  if (estimate.scale_sigma_m > 0.7 * error_m) {
    return "its distance is not sure; turn slowly between here and where the map began";
  }
  const bool guessed = place.method == AnchorMethod::kMedianDepth && !place.seed;
  if (place.was_tracking) return "look at it from nearby";
  return guessed ? "its depth is a guess; place it again on something that the map has"
                 : "move the camera sideways";
}

std::string PausedReason(const MapSnapshot& snapshot, const Excess& metres, const Excess& pixels,
                         const AnchorPlace& place, const PlaceEstimate& estimate) {
  if (!metres.above && !pixels.above) {
    const bool by_metres = metres.error * pixels.limit >= pixels.error * metres.limit;
    return absl::StrCat(
        "expected error ",
        by_metres ? Compare(metres, snapshot, place) : Compare(pixels.error, pixels.limit, "px"),
        " again: trusted if it stays there");
  }
  // A pose that is only predicted drifts: its figure says nothing of the mark.
  if (snapshot.status == TrackingStatus::kCoasting) {
    return "expected error is not known while coasting: show a place seen before";
  }
  return absl::StrCat(
      "expected error ",
      metres.above ? Compare(metres, snapshot, place) : Compare(pixels.error, pixels.limit, "px"),
      ": ", Remedy(place, estimate, metres.error));
}

std::string ProvisionalReason(double relative, const AnchorOptions& options,
                              const AnchorPlace& place, const PlaceEstimate& estimate) {
  if (!HasNearMember(place)) return "no mapped feature is near it yet: look around there";
  if (relative < options.tracking_sigma) return "";
  return absl::StrCat("its depth is known to ", absl::StrFormat("%.0f %%: ", 1e2 * relative),
                      Remedy(place, estimate, relative * place.distance_m));
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

  Excess metres{anchor.error_m, PauseLimit(snapshot, options, place)};
  Excess pixels{anchor.error_px.value_or(0.0), options.pause_sigma_px};
  for (Excess* one : {&metres, &pixels}) one->above = !(one->error <= one->limit);
  const double relative = anchor.error_m / place.distance_m;
  const std::string trouble = TrackerTrouble(snapshot.status);
  UpdatePaused(snapshot, options, std::array{metres, pixels}, place);
  if (!place.was_tracking && trouble.empty()) {
    place.was_tracking = relative < options.tracking_sigma && !place.paused && HasNearMember(place);
  }

  if (!trouble.empty()) {
    anchor.state = AnchorState::kPaused;
    anchor.reason = trouble;
  } else if (place.paused) {  // new ones, too: who is above the limit is not to be trusted
    anchor.state = AnchorState::kPaused;
    anchor.reason = PausedReason(snapshot, metres, pixels, place, estimate);
  } else if (!place.was_tracking) {
    anchor.state = AnchorState::kProvisional;
    anchor.reason = ProvisionalReason(relative, options, place, estimate);
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
  const std::string unknown = "its place is not known in this map";
  const bool by_map = place.world_key == options.map_key;
  if (place.world_key.empty() || (!by_map && place.world_key != options.world_key)) {
    last.reason = unknown + ": it belongs to another one; delete it, or place it again";
  } else if (!by_map && !snapshot.metric) {
    last.reason = unknown + " yet: show the target";
  } else {
    const std::string trouble = TrackerTrouble(snapshot.status);
    last.reason =
        unknown + " yet: " + (trouble.empty() ? "wait until the camera is tracked again" : trouble);
  }
  return last;
}

}  // namespace saccade
