#pragma once

#include <absl/status/statusor.h>

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "server/calibrate/board.hpp"
#include "server/calibrate/picture_set.hpp"

namespace saccade {

/// What pictures showed of a flat target.
struct TargetViews {
  std::vector<BoardView> views;
  std::string target;  // in words
  cv::Size size;       // of the pictures
};

/// Looks for `target` (--target, MakeLensTarget's) in all pictures, of a grid of AprilTags with
/// GridPictures; progress and what is left out go to stderr. Errors as MakeLensTarget.
absl::StatusOr<TargetViews> FindTarget(const PictureSet& pictures, const std::string& target,
                                       int border_bits);

}  // namespace saccade
