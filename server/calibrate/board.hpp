#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// A printed chessboard: inner corners along its sides, and the side of one square.
struct BoardPattern {
  int columns = 0, rows = 0;
  double square_m = 0;

  cv::Size size() const { return {columns, rows}; }
  /// Corner (i, j) at entry j * columns + i, in the plane z = 0 [m].
  std::vector<cv::Point3d> Points() const;
  /// "board of 9 x 6 corners, 0.025 m".
  std::string Words() const;
};

/// "9x6" and the side of a square. InvalidArgument: not that, fewer than 3 corners along a side, or
/// a side that is not between a millimetre and ten metres.
absl::StatusOr<BoardPattern> ParseBoard(const std::string& board, double square_m);

/// The board in one picture.
struct BoardView {
  std::uint64_t frame = 0;
  Timestamp time_ns = 0;
  std::vector<cv::Point2d> corners;  // [px]
  std::vector<cv::Point3d> points;   // what they are of, in the board's plane z = 0 [m]
};

/// The board's corners to a few hundredths of a pixel; nothing if it is not wholly in view. Which
/// way round it is taken does not matter here: each view has a pose of its own.
std::vector<cv::Point2d> FindBoard(const cv::Mat& grey, const BoardPattern& pattern);

}  // namespace saccade
