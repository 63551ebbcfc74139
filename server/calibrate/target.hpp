#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "server/calibrate/board.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// A flat target of a calibration, and finding it in one picture. One thread.
class LensTarget {
 public:
  virtual ~LensTarget() = default;

  /// In words, for reports: "board of 9 x 6 corners, 0.025 m".
  const std::string& words() const { return words_; }
  /// What a picture lacks that has no view: "no whole board in view".
  const std::string& missing() const { return missing_; }

  /// Puts corners and their points into `view`; none where the target is not in view.
  virtual void Find(const cv::Mat& grey, BoardView& view) = 0;
  /// Looks again, with a lens that is known by now; whether there is more to find so.
  virtual bool Refine(const cv::Mat& /*grey*/, const CameraModel& /*camera*/, BoardView& /*view*/) {
    return false;
  }
  /// Whether Refine does anything, so that pictures are worth keeping.
  virtual bool refines() const { return false; }

 protected:
  LensTarget(std::string words, std::string missing)
      : words_(std::move(words)), missing_(std::move(missing)) {}

 private:
  std::string words_, missing_;
};

/// chessboard:9x6:0.04              inner corners, side of a square [m]
/// charuco:7x5:0.04:0.03[:FAMILY]   squares, sides of a square and of a marker [m]
/// aprilgrid:6x6:0.088:0.3          tags, side of a tag [m], gap as a share of it; or a FILE of
///                                  Kalibr's; `border_bits` 0: 2 or 1, whichever reads more
/// arucogrid:5x7:0.04:0.01[:FAMILY] markers, side of a marker and gap [m]: OpenCV's grid board
/// InvalidArgument: it is none of these, or cannot be; says what is wrong of it.
absl::StatusOr<std::unique_ptr<LensTarget>> MakeLensTarget(const std::string& text,
                                                           int border_bits = 0);

}  // namespace saccade
