#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace saccade {

enum class CellShade : std::uint8_t { kBlack, kWhite, kRed };

/// A square marker as it is printed, upright, its black border included.
struct MarkerPattern {
  int cells = 0;                  // along a side
  std::vector<CellShade> shades;  // row by row from the top left
  /// Of a sighting's corners 0 to 3, in the unit square: x right, y down from the top left.
  std::array<Eigen::Vector2d, 4> corners;

  CellShade At(int row, int column) const { return shades[row * cells + column]; }
};

/// The marker `id` of "koller", "apriltag36h11", "aruco_4x4_50", ...
///   InvalidArgument  no such family, or the id is not in it; says what there is
absl::StatusOr<MarkerPattern> PatternOf(const std::string& family, int id);

}  // namespace saccade
