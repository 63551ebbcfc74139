#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "server/scene/collision.hpp"

namespace saccade {

struct PlacementRequest {
  Rigid3 world_from_body;                              // where it is let go
  Eigen::Vector3d gravity = Eigen::Vector3d::UnitY();  // unit, in world
  /// Where to push it first, of any length; the part along gravity is left out. None: not at all.
  std::optional<Eigen::Vector3d> push;
  double most_push_m = 20.0;
  double most_drop_m = 5.0;
};

/// What a thing came to touch.
struct Contact {
  std::string obstacle_id, obstacle_name;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_in_world = Eigen::Vector3d::UnitY();  // unit, out of the obstacle
  double moved_m = 0;                                          // until then
};

struct Placement {
  Rigid3 world_from_start;                  // where it was let go, raised if it had to be
  std::optional<Rigid3> world_from_pushed;  // before it was lowered; none: it was not pushed
  std::optional<Contact> stop;              // what stopped the push
  Rigid3 world_from_body;                   // at rest
  Contact support;
};

/// What is left between surfaces that touch, along the way there: neither a gap that anybody sees
/// nor a touch that rounding turns into a cut.
inline constexpr double kContactGap_m = 2e-4;

/// Pushes a thing until it touches something, then lowers it until it rests. It does not turn.
/// One that is let go within 2 cm below where it is free (on the floor, say) is raised first.
///   InvalidArgument     not finite, gravity not a unit vector, a push along gravity
///   FailedPrecondition  it starts inside of something, nothing stops the push within
///                       `most_push_m`, nothing holds it within `most_drop_m`; names what and how
///                       far
absl::StatusOr<Placement> Place(const CollisionScene& scene, const Body& body,
                                const PlacementRequest& request);

}  // namespace saccade
