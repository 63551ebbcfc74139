#include "server/anchors/measure.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

double TotalWeight(const AnchorPlace& place) {
  double total = 0;
  for (const ClusterMember& member : place.members) total += member.weight;
  return total;
}

/// Of the landmarks that carry both: as FromCluster weighs them, in the camera's frame.
Eigen::Matrix3d SharedByMembers(const MapView& map, const AnchorPlace& first,
                                const AnchorPlace& second) {
  Eigen::Matrix3d shared = Eigen::Matrix3d::Zero();
  // Where a feature at the very pixel knows better, the members do not tell the error.
  if (first.seed_covariance || second.seed_covariance) return shared;
  const double first_total = TotalWeight(first), second_total = TotalWeight(second);
  for (const ClusterMember& member : first.members) {
    const auto same = std::find_if(second.members.begin(), second.members.end(),
                                   [&member](const auto& one) { return one.id == member.id; });
    const FeatureSnapshot* feature = map.Find(member.id);
    if (same == second.members.end() || feature == nullptr) continue;
    shared += std::min(member.weight / first_total, same->weight / second_total) *
              feature->covariance_in_camera;
  }
  return shared;
}

/// How much one has to distrust what it says.
int Badness(const Anchor& anchor) {
  if (!anchor.place_known) return 4;
  switch (anchor.state) {
    case AnchorState::kTracking:
      return 0;
    case AnchorState::kProvisional:
      return 1;
    case AnchorState::kPaused:
      return 2;
    case AnchorState::kStopped:
      return 3;
  }
  return 3;
}

}  // namespace

double LengthSigma(const Eigen::Vector3d& offset_in_world, const Eigen::Matrix3d& first,
                   const Eigen::Matrix3d& second, const Eigen::Matrix3d& shared) {
  const Eigen::Matrix3d between = first + second - shared - shared.transpose();
  const double length = offset_in_world.norm();
  if (length < 1e-6) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(between, Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(0.0, solver.eigenvalues()(2)));
  }
  const Eigen::Vector3d along = offset_in_world / length;
  return std::sqrt(std::max(0.0, along.dot(between * along)));
}

Measured MeasureBetween(const MapView& map, const AnchorPlace& first, const PlaceEstimate& at_first,
                        const AnchorPlace& second, const PlaceEstimate& at_second) {
  Measured measured;
  measured.offset_in_world = at_second.point_in_world - at_first.point_in_world;
  measured.length_m = measured.offset_in_world.norm();
  const Rigid3& world_from_camera = map.snapshot().world_from_camera;
  const Eigen::Matrix3d turn = world_from_camera.RotationMatrix();
  Eigen::Matrix3d shared = turn * SharedByMembers(map, first, second) * turn.transpose();
  // One factor draws both along their lines of sight, as far as both parts have it.
  const Eigen::Vector3d to_first = at_first.point_in_world - world_from_camera.translation;
  const Eigen::Vector3d to_second = at_second.point_in_world - world_from_camera.translation;
  const double factor = std::min(at_first.scale_sigma_m / std::max(1e-9, to_first.norm()),
                                 at_second.scale_sigma_m / std::max(1e-9, to_second.norm()));
  shared += factor * factor * to_first * to_second.transpose();
  measured.sigma_m =
      LengthSigma(measured.offset_in_world, turn * at_first.covariance_in_camera * turn.transpose(),
                  turn * at_second.covariance_in_camera * turn.transpose(), shared);
  return measured;
}

Anchor JoinEnds(const Anchor& first, const Anchor& second) {
  Anchor joined = first;
  joined.error_m = std::max(first.error_m, second.error_m);
  if (Badness(second) <= Badness(first)) return joined;
  joined.state = second.state;
  joined.place_known = first.place_known && second.place_known;
  joined.reason = absl::StrCat("its other end: ", second.reason);
  return joined;
}

}  // namespace saccade
