#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/view.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/scene_object.hpp"

/// Where things of the scene are met, and where they go. Gravity is +y of the world
/// (docs/scene.md).
namespace saccade::tools {

/// A ray into the scene and what it met.
struct ThingHit {
  const SceneObject* thing = nullptr;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();     // [m]
  Eigen::Vector3d normal_in_world = -Eigen::Vector3d::UnitY();  // unit, towards the eye
};

/// The first surface of what stops things; of models, whose triangles are left to the server, none.
std::optional<ThingHit> HitSurface(const Scene& scene, const RayTarget& ray);
/// The thing whose box is there; rooms, in which everything is, are none. Null: nothing.
const SceneObject* PickThing(const Scene& scene, const RayTarget& ray);

/// The twelve edges of its box, in the world [m].
std::vector<std::array<Eigen::Vector3d, 2>> EdgesOfBox(const Scene& scene,
                                                       const SceneObject& thing);

/// Where a thing is let go that is to stand at `clicked`, its front to whoever looks along `sight`.
Rigid3 AboveFloor(const Eigen::Vector3d& clicked, const Eigen::Vector3d& sight);
/// `pose` turned about the vertical, a little above where it was.
Rigid3 TurnedBy(const Rigid3& pose, double angle_rad);

enum class Way { kLeft, kRight, kAway, kNearer };
/// A way along the floor, as an eye turned so sees it: unit.
Eigen::Vector3d WayInWorld(const Eigen::Quaterniond& world_from_eye, Way way);

/// `name`, with a number behind it where the scene has one of that name.
std::string FreeName(const Scene& scene, const std::string& name);

}  // namespace saccade::tools
