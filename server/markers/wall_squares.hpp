#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "server/markers/marker.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// Square markers whose places in a room are known, as of two walls that meet.
struct WallSquares {
  struct Square {
    double side_m = 0;  // of its black border
    /// x to the right, y up and z towards who reads it upright; from its middle.
    Rigid3 world_from_square;
  };
  std::string family;
  std::map<int, Square> squares;  // by id

  /// In the order of MarkerSighting::corners [m, world]; the square must be there.
  std::array<Eigen::Vector3d, 4> Corners(int id) const;
  /// How far the corners of all squares are from one plane: the root of the mean square, against
  /// their spread. Zero: one wall.
  double Depth() const;
};

/// Reads `family` and `squares`, a list of `id`, `side_m`, `centre_m` (x y z) and
/// `orientation_xyzw`. InvalidArgument: file, line, field and remedy; also fewer than two squares,
/// an id twice, or all of them in one plane (which says nothing of a lens in one view).
absl::StatusOr<WallSquares> LoadWallSquares(const std::filesystem::path& file);

}  // namespace saccade
