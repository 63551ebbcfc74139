#pragma once

#include <absl/status/statusor.h>

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "server/eval/calibrate/board.hpp"
#include "server/eval/calibrate/picture_set.hpp"

namespace saccade {

/// What pictures showed of a flat target.
struct TargetViews {
  std::vector<BoardView> views;
  std::string target;  // in words
  cv::Size size;       // of the pictures
};

/// Looks for `target` (--target: chessboard:9x6:0.04, charuco:7x5:0.04:0.03[:FAMILY],
/// aprilgrid:6x6:0.088:0.3 or aprilgrid:FILE) in all pictures; progress and what is left out go to
/// stderr. InvalidArgument: it is none of these, or cannot be; says what is wrong of it.
absl::StatusOr<TargetViews> FindTarget(const PictureSet& pictures, const std::string& target,
                                       int border_bits);

}  // namespace saccade
