#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/landing.hpp"
#include "shared/scene/scene_object.hpp"

/// Known geometry by clicks, as web/src/tools/thing_places.ts and ui/thing_measure.ts have it.
/// Gravity is +y of the world.
namespace saccade::tools {

struct Measured {
  Rigid3 pose;                                       // world_from_object
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  // a plane's y: 0
};

/// The rectangle with one side from `a` to `b` whose other side goes through `c`, seen from `eye`.
/// InvalidArgument, in words: the points lie on a line.
absl::StatusOr<Measured> PlaneOf(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                 const Eigen::Vector3d& c, const Eigen::Vector3d& eye);
/// The upright box between two opposite corners, turned so. InvalidArgument, in words: a side below
/// 10 mm.
absl::StatusOr<Measured> BoxOf(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Quaterniond& world_from_box);

struct RoomPoints {
  Eigen::Vector3d floor;
  std::array<Eigen::Vector3d, 2> wall;   // of one wall
  std::array<Eigen::Vector3d, 2> sides;  // one of each of the walls beside it
  Eigen::Vector3d opposite;
};
/// The room whose floor and four walls go through these points. InvalidArgument, in words: two of
/// its walls are not apart.
absl::StatusOr<Measured> RoomOf(const RoomPoints& points, double height_m);

/// Words where a click met no mapped surface.
extern const char* const kUnmeasured;
/// Whether a landing was measured, by a feature or on a plane of features.
bool IsMeasured(const std::optional<Landing>& landing);

/// A plane by three points, a box by two corners, a room by six points, one click each.
class Measuring {
 public:
  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  void Clear() { points_.clear(); }
  /// What the next click of that shape is, in words. `shape`: kPlane, kBox or kRoom.
  std::string Hint(SceneShape shape) const;
  /// Nothing: more points are wanted. Errors in words; after those of the shape as a whole it
  /// begins anew.
  absl::StatusOr<std::optional<SceneObject>> Click(SceneShape shape,
                                                   const std::optional<Landing>& landing,
                                                   const View& view, const Scene& scene);

 private:
  absl::StatusOr<std::optional<Measured>> Made(SceneShape shape, const View& view,
                                               const Scene& scene) const;
  std::vector<Eigen::Vector3d> points_;
};

}  // namespace saccade::tools
