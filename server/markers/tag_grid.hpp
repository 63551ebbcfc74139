#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <array>
#include <filesystem>
#include <string>

namespace saccade {

/// A sheet of AprilTags in rows, with small black squares where the corners of four meet (Kalibr's
/// AprilGrid). Ids rise from the lower left along the rows.
struct TagGrid {
  std::string family = "apriltag36h11";
  int columns = 0, rows = 0;
  double side_m = 0;   // of a tag's black border
  double spacing = 0;  // between tags, as a share of side_m

  int tags() const { return columns * rows; }
  bool Holds(int id) const { return id >= 0 && id < tags(); }
  /// Corners of tag `id` in the sheet's plane z = 0, x right, y up, in MarkerSighting's order [m].
  std::array<Eigen::Vector3d, 4> Corners(int id) const;
};

/// Kalibr's aprilgrid.yaml: target_type, tagCols, tagRows, tagSize, tagSpacing.
///   NotFound         no such file
///   InvalidArgument  names the line and the field
absl::StatusOr<TagGrid> LoadTagGrid(const std::filesystem::path& file);

/// "6x6:0.088:0.3": columns, rows, side [m], spacing.
absl::StatusOr<TagGrid> ParseTagGrid(const std::string& text);

}  // namespace saccade
