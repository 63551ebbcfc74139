#include "client/tools/measured.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "client/tools/things.hpp"

namespace saccade::tools {
namespace {

using Eigen::Vector3d;

constexpr double kLeastSide_m = 0.01, kLeastRoom_m = 0.5, kLeastWall_m = 0.1;
constexpr double kRoomHeight_m = 2.5;  // its ceiling is where nobody looks
constexpr double kSamePoint_m = 1e-6;
constexpr std::array<const char*, 6> kRoomSteps = {
    "a point of the floor", "a point of one wall",   "another point of that wall, beside the first",
    "the wall at its left", "the wall at its right", "the wall opposite"};
constexpr std::array<const char*, 3> kPlaneSteps = {"one end of an edge", "its other end",
                                                    "the opposite edge"};

std::string Millimetres(double m) { return absl::StrFormat("%.0f mm", 1000 * m); }

Eigen::Quaterniond FromAxes(const Vector3d& x, const Vector3d& y, const Vector3d& z) {
  Eigen::Matrix3d axes;
  axes << x, y, z;
  return Eigen::Quaterniond(axes).normalized();
}

}  // namespace

const char* const kUnmeasured = "nothing was measured there; click where the map has features";

bool IsMeasured(const std::optional<Landing>& landing) {
  return landing && (landing->how == How::kFeature || landing->how == How::kPlane);
}

absl::StatusOr<Measured> PlaneOf(const Vector3d& a, const Vector3d& b, const Vector3d& c,
                                 const Vector3d& eye) {
  const Vector3d along = b - a, normal = along.cross(c - a);
  const double width_m = along.norm(), depth_m = width_m > 0 ? normal.norm() / width_m : 0;
  if (width_m < kLeastSide_m || depth_m < kLeastSide_m) {
    return absl::InvalidArgumentError(absl::StrCat("the three points lie within ",
                                                   Millimetres(std::min(width_m, depth_m)),
                                                   " of a line; click them farther apart"));
  }
  const Vector3d up = normal.normalized();
  const Vector3d y = up.dot(eye - a) > 0 ? Vector3d(-up) : up;  // its own y axis is down
  const Vector3d x = along.normalized(), z = x.cross(y);
  const double far = z.dot(c - a);
  return Measured{{FromAxes(x, y, z), 0.5 * (a + b) + 0.5 * far * z}, {width_m, 0, std::abs(far)}};
}

absl::StatusOr<Measured> BoxOf(const Vector3d& a, const Vector3d& b,
                               const Eigen::Quaterniond& world_from_box) {
  const Vector3d size = (world_from_box.conjugate() * (b - a)).cwiseAbs();
  constexpr std::array<const char*, 3> kSides = {"wide", "high", "deep"};
  for (int axis = 0; axis < 3; ++axis) {
    if (size[axis] >= kLeastSide_m) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("the box would be ", Millimetres(size[axis]), " ", kSides[axis],
                     "; click two opposite corners, one low and one high"));
  }
  Vector3d base = 0.5 * (a + b);
  base.y() = std::max(a.y(), b.y());
  return Measured{{world_from_box, base}, size};
}

absl::StatusOr<Measured> RoomOf(const RoomPoints& points, double height_m) {
  const auto& [a, b] = points.wall;
  const Vector3d along(b.x() - a.x(), 0, b.z() - a.z());
  if (along.norm() < kLeastWall_m) {
    return absl::InvalidArgumentError(
        "the two points of the wall lie above each other; click one farther to the side");
  }
  const Vector3d line = along.normalized(), across = line.cross(Vector3d::UnitY());
  // Away from whoever stands in the room, before the wall.
  const double sign = across.dot(points.opposite - a) > 0 ? -1 : 1;
  const Vector3d x = sign * line, z = sign * across;
  const auto [low, high] = std::minmax({x.dot(points.sides[0]), x.dot(points.sides[1])});
  const double near = z.dot(points.opposite), far = 0.5 * (z.dot(a) + z.dot(b));
  if (high - low < kLeastRoom_m || far - near < kLeastRoom_m) {
    return absl::InvalidArgumentError(absl::StrCat("two opposite walls would be ",
                                                   Millimetres(std::min(high - low, far - near)),
                                                   " apart; click one point on each wall"));
  }
  Vector3d middle = 0.5 * (low + high) * x + 0.5 * (near + far) * z;
  middle.y() = points.floor.y();
  return Measured{{AboveFloor(middle, z).rotation, middle}, {high - low, height_m, far - near}};
}

std::string Measuring::Hint(SceneShape shape) const {
  const std::size_t clicked = points_.size();
  switch (shape) {
    case SceneShape::kPlane:
      return absl::StrCat("Plane, point ", clicked + 1, " of 3: click ",
                          kPlaneSteps[std::min(clicked, kPlaneSteps.size() - 1)], ".");
    case SceneShape::kRoom:
      return absl::StrCat("Room, point ", clicked + 1, " of ", kRoomSteps.size(), ": click ",
                          kRoomSteps[std::min(clicked, kRoomSteps.size() - 1)], ".");
    case SceneShape::kBox:
    case SceneShape::kModel:
      break;
  }
  return absl::StrCat("Box, corner ", clicked + 1, " of 2: click ",
                      clicked == 0 ? "a lower corner" : "the opposite upper corner", ".");
}

absl::StatusOr<std::optional<SceneObject>> Measuring::Click(SceneShape shape,
                                                            const std::optional<Landing>& landing,
                                                            const View& view, const Scene& scene) {
  if (!IsMeasured(landing)) return absl::FailedPreconditionError(kUnmeasured);
  const Vector3d& point = landing->point_in_world;
  if (std::ranges::any_of(
          points_, [&](const Vector3d& one) { return (one - point).norm() < kSamePoint_m; })) {
    return absl::AlreadyExistsError("that is a point you clicked already");
  }
  points_.push_back(point);
  const absl::StatusOr<std::optional<Measured>> made = Made(shape, view, scene);
  if (made.ok() && !made->has_value()) return std::nullopt;
  points_.clear();
  if (!made.ok()) return made.status();
  SceneObject object;
  object.shape = shape;
  object.name = FreeName(scene, shape == SceneShape::kPlane  ? "plane"
                                : shape == SceneShape::kRoom ? "room"
                                                             : "box");
  object.size_m = (*made)->size_m;
  object.parent_from_object = (*made)->pose;
  return object;
}

absl::StatusOr<std::optional<Measured>> Measuring::Made(SceneShape shape, const View& view,
                                                        const Scene& scene) const {
  const std::vector<Vector3d>& p = points_;
  const std::size_t wanted = shape == SceneShape::kBox     ? 2
                             : shape == SceneShape::kPlane ? 3
                                                           : kRoomSteps.size();
  if (p.size() < wanted) return std::nullopt;
  if (shape == SceneShape::kPlane) return PlaneOf(p[0], p[1], p[2], view.eye());
  if (shape == SceneShape::kRoom) {
    return RoomOf({p[0], {p[1], p[2]}, {p[3], p[4]}, p[5]}, kRoomHeight_m);
  }
  // As the room is turned, where there is one.
  const auto room = std::ranges::find(scene.objects, SceneShape::kRoom, &SceneObject::shape);
  if (room != scene.objects.end()) return BoxOf(p[0], p[1], room->parent_from_object.rotation);
  const Vector3d away = WayInWorld(view.world_from_camera.rotation, Way::kAway);
  return BoxOf(p[0], p[1], AboveFloor(p[0], away).rotation);
}

}  // namespace saccade::tools
