#pragma once

#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "server/calibrate/board.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade::testing {

/// Draws a printed chessboard as a lens sees it: a ray for each of 3 x 3 parts of each pixel.
class BoardCamera {
 public:
  BoardCamera(const CameraIntrinsics& lens, const BoardPattern& pattern);

  /// Noise of `noise` grey levels, one sigma.
  cv::Mat Draw(const cv::Matx33d& camera_from_board, const cv::Vec3d& board_in_camera_m,
               double noise, std::mt19937& random) const;
  const CameraIntrinsics& lens() const { return lens_; }

 private:
  CameraIntrinsics lens_;
  BoardPattern pattern_;
  std::vector<cv::Vec3f> rays_;  // z = 0: none
};

/// How somebody moves a board before a camera: at each of `count` moments a place in the picture, a
/// distance and a tilt of up to `tilt_deg`.
std::vector<cv::Mat> ShownBoard(const BoardCamera& camera, const BoardPattern& pattern, int count,
                                double tilt_deg, double noise, unsigned seed);

}  // namespace saccade::testing
