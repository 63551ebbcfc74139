#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <Eigen/Dense>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// Corners of a square marker in its own frame [m]: middle at the origin, x right, y up and z
/// towards who looks at it; in MarkerSighting's order.
std::array<Eigen::Vector3d, 4> SquareCorners(absl::string_view family, double side_m);

/// A square whose place in the building is known.
struct KnownSquare {
  std::string family;  // "apriltag36h11", ...
  int id = 0;
  double side_m = 0;  // of its black border
  Rigid3 world_from_square;

  std::array<Eigen::Vector3d, 4> CornersInWorld() const;
};

/// Where squares are; each (family, id) at most once.
struct SquareMap {
  std::vector<KnownSquare> squares;

  const KnownSquare* Find(absl::string_view family, int id) const;
  /// InvalidArgument: a square twice, a side that is no length, a rotation that is none; says
  /// which.
  absl::Status Validate() const;
  /// As a file has it.
  std::string ToToml() const;
};

/// Reads a map of squares (docs/configuration.md):
///   [[square]]
///   family = "apriltag36h11"
///   id = 3
///   side_m = 0.16
///   middle_m = [1.2, 0.4, 0.0]           # in world
///   rotation_xyzw = [0.0, 0.0, 0.0, 1.0] # world from square: x right, y up, z out of its face
///   NotFound         no such file
///   InvalidArgument  names the file, the square and the field
absl::StatusOr<SquareMap> LoadSquareMap(const std::filesystem::path& file);

}  // namespace saccade
