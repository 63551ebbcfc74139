#include "server/scene/placement.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace saccade {
namespace {

constexpr double kRaise_m = 5e-3;     // off the floor while it is pushed
constexpr double kMostSunk_m = 2e-2;  // what a thing let go on the floor may be too low
constexpr double kBisection_m = 1e-4;
constexpr double kHeadOn = 0.05;  // sine: what meets a wall so does not slide
constexpr double kLeastSlide_m = 1e-3;
constexpr int kMostTurns = 4;  // things that it slides along, one after the other

Rigid3 Shifted(const Rigid3& pose, const Eigen::Vector3d& by) {
  return {pose.rotation, pose.translation + by};
}

absl::Status Check(const PlacementRequest& request) {
  const Rigid3& pose = request.world_from_body;
  if (!pose.translation.allFinite() || !(std::abs(pose.rotation.norm() - 1) < 1e-3)) {
    return absl::InvalidArgumentError("pose: not finite, or no unit quaternion");
  }
  if (!(std::abs(request.gravity.norm() - 1) < 1e-6)) {
    return absl::InvalidArgumentError("gravity: no unit vector");
  }
  if (request.push && !request.push->allFinite()) {
    return absl::InvalidArgumentError("push: not finite");
  }
  if (!(request.hand_m >= 0 && request.hand_m <= request.most_push_m)) {
    return absl::InvalidArgumentError(
        absl::StrCat("hand_m: ", request.hand_m, "; give 0 to ", request.most_push_m, " metres"));
  }
  return absl::OkStatus();
}

/// Moves until kContactGap_m before the first touch, checked by the other way to see one: what
/// rounding leaves cut is taken back by bisection.
std::optional<Contact> MoveUntilTouch(const CollisionScene& scene, const Body& body,
                                      const Eigen::Vector3d& direction, double most_m,
                                      Rigid3& pose) {
  const std::optional<SweepHit> hit = scene.Sweep(body, pose, direction, most_m + kContactGap_m);
  if (!hit) return std::nullopt;
  double way_m = std::max(0.0, hit->distance_m - kContactGap_m);
  if (scene.Overlap(body, Shifted(pose, way_m * direction))) {
    double free_m = 0;
    while (way_m - free_m > kBisection_m) {
      const double middle_m = 0.5 * (free_m + way_m);
      (scene.Overlap(body, Shifted(pose, middle_m * direction)) ? way_m : free_m) = middle_m;
    }
    way_m = free_m;
  }
  pose = Shifted(pose, way_m * direction);
  const Obstacle& obstacle = scene.obstacles()[hit->owner];
  return Contact{obstacle.id, obstacle.name, hit->point, hit->normal, way_m};
}

/// Raised by as little as frees it.
absl::StatusOr<Rigid3> FreeStart(const CollisionScene& scene, const Body& body,
                                 const PlacementRequest& request) {
  for (const double raise_m : {0.0, 2e-4, 1e-3, 5e-3, kMostSunk_m}) {
    const Rigid3 pose = Shifted(request.world_from_body, -raise_m * request.gravity);
    if (!scene.Overlap(body, pose)) return pose;
  }
  const std::optional<std::size_t> in = scene.Overlap(body, request.world_from_body);
  return absl::FailedPreconditionError(absl::StrCat("pose: it would start inside of '",
                                                    scene.obstacles()[*in].name,
                                                    "'; let it go where there is room"));
}

/// Along what stopped it, as far as the hand goes on; into a corner, not out of it again.
void Slide(const CollisionScene& scene, const Body& body, const PlacementRequest& request,
           const Eigen::Vector3d& way, Rigid3& pose, Placement& placement) {
  const auto level = [&request](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v - v.dot(request.gravity) * request.gravity);
  };
  double left_m = request.hand_m - placement.stop->moved_m;
  std::vector<Eigen::Vector3d> walls;
  Contact last = *placement.stop;
  for (int turn = 0; turn < kMostTurns && left_m > kLeastSlide_m; ++turn) {
    const Eigen::Vector3d normal = level(last.normal_in_world);
    if (!(normal.norm() > kHeadOn)) return;  // it stands on what stops it: a step
    walls.push_back(normal.normalized());
    const Eigen::Vector3d along = way - way.dot(walls.back()) * walls.back();
    const double share = along.norm();
    const auto into = [&along](const Eigen::Vector3d& wall) { return along.dot(wall) < -1e-6; };
    if (share < kHeadOn || std::any_of(walls.begin(), walls.end() - 1, into)) return;
    const std::optional<Contact> next =
        MoveUntilTouch(scene, body, along / share, share * left_m, pose);
    const double moved_m = next ? next->moved_m : share * left_m;
    if (!next) pose = Shifted(pose, moved_m * along / share);
    placement.slid_m += moved_m;
    placement.world_from_turns.push_back(pose);
    left_m -= moved_m / share;
    if (!next) return;
    placement.slide_stop = last = *next;
  }
}

absl::Status Push(const CollisionScene& scene, const Body& body, const PlacementRequest& request,
                  Rigid3& pose, Placement& placement) {
  const Eigen::Vector3d level =
      *request.push - request.push->dot(request.gravity) * request.gravity;
  if (!(level.norm() > 1e-3 * request.push->norm())) {
    return absl::InvalidArgumentError("push: has no part along the floor; give another direction");
  }
  // An uneven floor must not stop it: it is carried low over it.
  const Eigen::Vector3d up = -request.gravity;
  const std::optional<SweepHit> ceiling = scene.Sweep(body, pose, up, kRaise_m + kContactGap_m);
  const double raise_m = ceiling ? std::max(0.0, ceiling->distance_m - kContactGap_m) : kRaise_m;
  pose = Shifted(pose, raise_m * up);
  placement.stop = MoveUntilTouch(scene, body, level.normalized(), request.most_push_m, pose);
  if (!placement.stop) {
    return absl::FailedPreconditionError(
        absl::StrCat("push: nothing stops it within ", request.most_push_m,
                     " m; push it another way, or add the wall to the scene"));
  }
  placement.world_from_turns.push_back(pose);
  Slide(scene, body, request, level.normalized(), pose, placement);
  placement.world_from_pushed = pose;
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Placement> Place(const CollisionScene& scene, const Body& body,
                                const PlacementRequest& request) {
  if (absl::Status valid = Check(request); !valid.ok()) return valid;
  absl::StatusOr<Rigid3> pose = FreeStart(scene, body, request);
  if (!pose.ok()) return pose.status();
  Placement placement;
  placement.world_from_start = *pose;
  if (request.push) {
    absl::Status pushed = Push(scene, body, request, *pose, placement);
    if (!pushed.ok()) return pushed;
  }
  const std::optional<Contact> support =
      MoveUntilTouch(scene, body, request.gravity, request.most_drop_m, *pose);
  if (!support) {
    return absl::FailedPreconditionError(
        absl::StrCat("pose: nothing holds it within ", request.most_drop_m,
                     " m below; let it go over the floor, or add the floor to the scene"));
  }
  placement.support = *support;
  placement.world_from_body = *pose;
  return placement;
}

}  // namespace saccade
