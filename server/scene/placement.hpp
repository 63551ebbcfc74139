#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "server/scene/collision.hpp"

namespace saccade {

struct PlacementRequest {
  Rigid3 world_from_body;                              // where it is let go
  Eigen::Vector3d gravity = Eigen::Vector3d::UnitY();  // unit, in world
  /// Where to push it first, of any length; the part along gravity is left out. None: not at all.
  std::optional<Eigen::Vector3d> push;
  double most_push_m = 20.0;
  /// How far the hand goes that pushes: what meets something aslant before that slides along it as
  /// the hand goes on. 0: it stops where it touches.
  double hand_m = 0.0;
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
  double slid_m = 0;                        // along that
  std::optional<Contact> slide_stop;        // what it met while it slid
  std::vector<Rigid3> world_from_turns;     // where it touched, and where each slide ended
  Rigid3 world_from_body;                   // at rest
  Contact support;
};

/// What is left between surfaces that touch, along the way there: neither a gap that anybody sees
/// nor a touch that rounding turns into a cut.
inline constexpr double kContactGap_m = 2e-4;

/// Pushes a thing until it touches something, lets it slide along that as far as the hand still
/// goes, then lowers it until it rests. It does not turn.
/// One that is let go within 2 cm below where it is free (on the floor, say) is raised first.
///   InvalidArgument     not finite, gravity not a unit vector, a push along gravity, a hand that
///                       goes farther than `most_push_m`
///   FailedPrecondition  it starts inside of something, nothing stops the push within
///                       `most_push_m`, nothing holds it within `most_drop_m`; names what and how
///                       far
absl::StatusOr<Placement> Place(const CollisionScene& scene, const Body& body,
                                const PlacementRequest& request);

}  // namespace saccade
