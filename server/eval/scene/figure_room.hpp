#pragma once

#include <absl/status/statusor.h>

#include "server/markers/square_map.hpp"
#include "server/sim/surface.hpp"
#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// The room of the figures: a corner with eight of Koller's squares on its walls, a door, a cabinet
/// and an alarm button. World: x right along the wall with the door, y down, the floor at 0, that
/// wall at z = 0; who looks at it is at negative z.
struct FigureRoom {
  RoomScene scene;
  TriangleMesh real;  // as somebody has measured it, in world
  SquareMap squares;

  static constexpr double kSide_m = 0.2;  // of a square
  // Places in world [m].
  static inline const Eigen::Vector3d kAlarm{1.62, -1.45, -0.05};
  static inline const Eigen::Vector3d kCabinetBase{2.36, -0.88, -0.17};  // of its front
  static constexpr double kCabinetWidth_m = 0.5, kCabinetHeight_m = 0.66;
  static inline const Eigen::Vector3d kDoor{3.3, 0, -0.05};
};

/// `cartons`: a stack of them stands before some of the squares. Errors as PatternOf.
absl::StatusOr<FigureRoom> BuildFigureRoom(bool cartons);

}  // namespace saccade
