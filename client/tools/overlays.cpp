#include "client/tools/overlays.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "shared/models/glb_writer.hpp"
#include "shared/models/overlay_things.hpp"

namespace saccade::tools {
namespace {

using Eigen::Vector3d;

constexpr std::array<OverlayWords, 5> kOverlays = {
    {{OverlayKind::kGrid, "grid", "lays a grid on a floor: 1 point"},
     {OverlayKind::kRoute, "route", "marks a way: points, then Done"},
     {OverlayKind::kPipe, "pipe", "shows a pipe in a wall: points, then Done"},
     {OverlayKind::kWire, "wire", "shows a wire in a wall: points, then Done"},
     {OverlayKind::kPointer, "pointer", "lets an arrow point there: 1 point"}}};
constexpr std::array<std::uint32_t, 5> kOverlayColor = {0xc2cad2ff, 0x2bb16cff, 0x417bcaff,
                                                        0xe09e2bff, 0xe0342bff};
constexpr double kGridStep_m = 0.25, kGrid_m = 3, kMostGrid_m = 20;
constexpr double kRoute_m = 0.18;
constexpr double kInside_m = 0.05;  // how deep pipes and wires lie in their wall
constexpr double kPipe_m = 0.025, kWire_m = 0.008;
constexpr double kPointer_m = 0.4, kPointerRadius_m = 0.015;
constexpr double kAgain_m = 0.03;  // a click on the last point ends a way
constexpr double kLeastWay_m = 0.01;

std::uint32_t ColorOf(OverlayKind kind) { return kOverlayColor[static_cast<std::size_t>(kind)]; }

Overlay Made(OverlayKind kind, const TriangleMesh& mesh, const Rigid3& pose, const Scene& scene) {
  Overlay overlay;
  overlay.file = WriteGlb(mesh).value_or("");  // a mesh without triangles is refused before
  overlay.thing.name = FreeName(scene, kOverlays[static_cast<std::size_t>(kind)].name);
  overlay.thing.shape = SceneShape::kModel;
  const bool hidden = kind == OverlayKind::kPipe || kind == OverlayKind::kWire;
  overlay.thing.material = hidden ? SceneMaterial::kHidden : SceneMaterial::kGuide;
  overlay.thing.parent_from_object = pose;
  return overlay;
}

/// Over all of the floor, plane or box top that was clicked; else a field about the point.
Overlay GridAt(const OverlayPoint& point, const Scene& scene) {
  Eigen::Vector2d size(kGrid_m, kGrid_m);
  Rigid3 pose{Eigen::Quaterniond::Identity(), point.point_in_world};
  if (point.hit && std::abs(point.hit->normal_in_world.y()) > 0.9) {
    const SceneObject& flat = *point.hit->thing;
    size = {std::min(flat.size_m.x(), kMostGrid_m), std::min(flat.size_m.z(), kMostGrid_m)};
    pose = flat.parent_from_object;
    pose.translation.y() = point.point_in_world.y();
  }
  const std::uint32_t color = ColorOf(OverlayKind::kGrid);
  return Made(OverlayKind::kGrid, FloorGridMesh(size.x(), size.y(), kGridStep_m, color), pose,
              scene);
}

/// From beside and above the place, which is its origin.
Overlay PointerAt(const OverlayPoint& point, const Scene& scene) {
  const bool floor_from_below = point.normal_in_world.y() > 0.9;
  const Vector3d out = floor_from_below ? Vector3d::Zero() : point.normal_in_world;
  const Vector3d from = kPointer_m * (out - 0.8 * Vector3d::UnitY()).normalized();
  return Made(OverlayKind::kPointer,
              ArrowMesh(from, Vector3d::Zero(), kPointerRadius_m, ColorOf(OverlayKind::kPointer)),
              {Eigen::Quaterniond::Identity(), point.point_in_world}, scene);
}

}  // namespace

std::span<const OverlayWords> Overlays() { return kOverlays; }

void Overlaying::Clear() {
  points_.clear();
  normals_.clear();
}

std::string Overlaying::Hint(OverlayKind kind) const {
  if (kind == OverlayKind::kGrid) return "Click the floor that the grid is to lie on.";
  if (kind == OverlayKind::kPointer) return "Click what the arrow is to point at.";
  const char* where = kind == OverlayKind::kRoute ? "the way on the floor" : "the wall along it";
  const std::string next = absl::StrCat("Point ", points_.size() + 1, ": click ", where);
  return points_.size() < 2 ? absl::StrCat(next, ".")
                            : absl::StrCat(next, "; the last point again, or Done, ends it.");
}

absl::StatusOr<std::optional<Overlay>> Overlaying::Click(OverlayKind kind,
                                                         const OverlayPoint& point,
                                                         const Scene& scene) {
  if (kind == OverlayKind::kGrid) return GridAt(point, scene);
  if (kind == OverlayKind::kPointer) return PointerAt(point, scene);
  if (!points_.empty() && (points_.back() - point.point_in_world).norm() < kAgain_m) {
    absl::StatusOr<Overlay> made = Finish(kind, scene);
    if (!made.ok()) return made.status();
    return *std::move(made);
  }
  points_.push_back(point.point_in_world);
  normals_.push_back(point.normal_in_world);
  return std::nullopt;
}

absl::StatusOr<Overlay> Overlaying::Finish(OverlayKind kind, const Scene& scene) {
  const double inside = kind == OverlayKind::kRoute ? 0 : kInside_m;
  std::vector<Vector3d> way;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    way.emplace_back(points_[i] - inside * normals_[i]);
  }
  const Vector3d first = way.empty() ? Vector3d::Zero() : way.front();
  for (Vector3d& point : way) point -= first;
  if (!std::ranges::any_of(way, [](const Vector3d& one) { return one.norm() > kLeastWay_m; })) {
    return absl::FailedPreconditionError("click two points at least, apart from each other");
  }
  Clear();
  const TriangleMesh mesh =
      kind == OverlayKind::kRoute
          ? RouteMesh(way, kRoute_m, ColorOf(kind))
          : TubeMesh(way, kind == OverlayKind::kPipe ? kPipe_m : kWire_m, ColorOf(kind));
  return Made(kind, mesh, {Eigen::Quaterniond::Identity(), first}, scene);
}

}  // namespace saccade::tools
