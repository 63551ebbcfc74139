#include "client/tools/things.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace saccade::tools {
namespace {

constexpr double kRaised_m = 0.3;  // a thing is let go above a click: that is known to centimetres
constexpr double kLift_m = 0.002;  // off what it stands on, for a turn
constexpr double kParallel = 1e-12;

struct Box {
  Eigen::Vector3d low, high;
};
struct Met {
  double along = 0;  // in lengths of the direction
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

Eigen::Vector3d Down() { return Eigen::Vector3d::UnitY(); }

/// In its own frame.
Box BoxOf(const SceneObject& thing, const Scene& scene) {
  if (const auto model = scene.Model(thing.model); model && !model->mesh.positions.empty()) {
    Eigen::Vector3f low = model->mesh.positions.front(), high = low;
    for (const Eigen::Vector3f& each : model->mesh.positions) {
      low = low.cwiseMin(each);
      high = high.cwiseMax(each);
    }
    return {thing.scale * low.cast<double>(), thing.scale * high.cast<double>()};
  }
  const Eigen::Vector3d& size = thing.size_m;
  const double height = thing.shape == SceneShape::kPlane ? 0 : size.y();
  return {{-size.x() / 2, -height, -size.z() / 2}, {size.x() / 2, 0, size.z() / 2}};
}

/// Where the ray goes in, or of a room where it goes out.
std::optional<Met> MeetBox(const Eigen::Vector3d& from, const Eigen::Vector3d& along,
                           const Box& box, bool from_inside) {
  double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
  int enter_axis = 0, leave_axis = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(along[axis]) < kParallel) {
      if (from[axis] < box.low[axis] || from[axis] > box.high[axis]) return std::nullopt;
      continue;
    }
    const auto [near, far] = std::minmax(
        {(box.low[axis] - from[axis]) / along[axis], (box.high[axis] - from[axis]) / along[axis]});
    if (near > enter) {
      enter = near;
      enter_axis = axis;
    }
    if (far < leave) {
      leave = far;
      leave_axis = axis;
    }
  }
  const double at = from_inside ? leave : enter;
  const int axis = from_inside ? leave_axis : enter_axis;
  if (enter > leave || at <= 0) return std::nullopt;
  Met met{at, Eigen::Vector3d::Zero()};
  met.normal[axis] = along[axis] > 0 ? -1 : 1;
  return met;
}

/// The nearest of those things that `counts`.
template <typename Counts>
std::optional<ThingHit> Nearest(const Scene& scene, const RayTarget& ray, const Counts& counts) {
  std::optional<ThingHit> best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const SceneObject& thing : scene.objects) {
    if (thing.parent != SceneParent::kWorld || !counts(thing)) continue;
    const Rigid3 object_from_world = thing.parent_from_object.Inverse();
    const auto met = MeetBox(object_from_world * ray.origin_in_world,
                             object_from_world.rotation * ray.direction_in_world,
                             BoxOf(thing, scene), thing.shape == SceneShape::kRoom);
    if (!met || met->along >= nearest) continue;
    nearest = met->along;
    best = ThingHit{&thing, ray.origin_in_world + met->along * ray.direction_in_world,
                    thing.parent_from_object.rotation * met->normal};
  }
  return best;
}

Eigen::Vector3d Level(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d level(direction.x(), 0, direction.z());
  return level.norm() > kParallel ? level.normalized() : Eigen::Vector3d::UnitZ();
}

Eigen::Quaterniond AboutVertical(double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Down()));
}

}  // namespace

std::optional<ThingHit> HitSurface(const Scene& scene, const RayTarget& ray) {
  return Nearest(scene, ray, [](const SceneObject& thing) {
    const bool solid =
        thing.material == SceneMaterial::kReal || thing.material == SceneMaterial::kVirtual;
    return solid && thing.shape != SceneShape::kModel;
  });
}

const SceneObject* PickThing(const Scene& scene, const RayTarget& ray) {
  const auto hit = Nearest(
      scene, ray, [](const SceneObject& thing) { return thing.shape != SceneShape::kRoom; });
  return hit ? hit->thing : nullptr;
}

std::vector<std::array<Eigen::Vector3d, 2>> EdgesOfBox(const Scene& scene,
                                                       const SceneObject& thing) {
  const Box box = BoxOf(thing, scene);
  const auto corner = [&](int i) {
    return thing.parent_from_object * Eigen::Vector3d(i & 1 ? box.high.x() : box.low.x(),
                                                      i & 2 ? box.high.y() : box.low.y(),
                                                      i & 4 ? box.high.z() : box.low.z());
  };
  std::vector<std::array<Eigen::Vector3d, 2>> edges;
  for (int i = 0; i < 8; ++i) {
    for (const int bit : {1, 2, 4}) {
      if ((i & bit) == 0) edges.push_back({corner(i), corner(i | bit)});
    }
  }
  return edges;
}

Rigid3 AboveFloor(const Eigen::Vector3d& clicked, const Eigen::Vector3d& sight) {
  return {AboutVertical(std::atan2(sight.x(), sight.z())), clicked - kRaised_m * Down()};
}

Rigid3 TurnedBy(const Rigid3& pose, double angle_rad) {
  return {AboutVertical(angle_rad) * pose.rotation, pose.translation - kLift_m * Down()};
}

Eigen::Vector3d WayInWorld(const Eigen::Quaterniond& world_from_eye, Way way) {
  const Eigen::Vector3d right = Level(world_from_eye * Eigen::Vector3d::UnitX());
  const Eigen::Vector3d away = right.cross(Down());
  switch (way) {
    case Way::kLeft:
      return -right;
    case Way::kRight:
      return right;
    case Way::kAway:
      return away;
    case Way::kNearer:
      break;
  }
  return -away;
}

std::string FreeName(const Scene& scene, const std::string& name) {
  const auto taken = [&scene](const std::string& one) {
    return std::ranges::any_of(scene.objects,
                               [&one](const SceneObject& each) { return each.name == one; });
  };
  std::string free = name;
  for (int n = 2; taken(free); ++n) free = absl::StrCat(name, " ", n);
  return free;
}

}  // namespace saccade::tools
