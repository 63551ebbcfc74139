#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <opencv2/aruco/charuco.hpp>
#include <string>
#include <vector>

namespace saccade {

/// A chessboard with a marker in each white square (OpenCV 4.6's pattern).
struct CharucoPattern {
  int columns = 0, rows = 0;  // squares
  double square_m = 0, marker_m = 0;
  std::string family = "aruco_4x4_50";
};

/// "7x5:0.04:0.03" or "7x5:0.04:0.03:aruco_5x5_250": squares along both sides, the side of a square
/// and of a marker in metres, and the markers' family. InvalidArgument says what is wrong of it.
absl::StatusOr<CharucoPattern> ParseCharuco(const std::string& text);

/// A corner where squares meet, told apart by the markers beside it.
struct CharucoCorner {
  int id = 0;
  Eigen::Vector2d pixel;
  Eigen::Vector3d point_m;  // in the board's plane z = 0
};

/// Finds the corners of one board; also of a board that is partly hidden or out of view.
class CharucoDetector {
 public:
  static absl::StatusOr<CharucoDetector> Make(const CharucoPattern& pattern);

  /// By rising id; `grey` is CV_8UC1. Empty: none, or too little to tell.
  std::vector<CharucoCorner> Detect(const cv::Mat& grey) const;

 private:
  CharucoDetector(cv::Ptr<cv::aruco::CharucoBoard> board,
                  cv::Ptr<cv::aruco::DetectorParameters> parameters)
      : board_(std::move(board)), parameters_(std::move(parameters)) {}

  cv::Ptr<cv::aruco::CharucoBoard> board_;
  cv::Ptr<cv::aruco::DetectorParameters> parameters_;
};

}  // namespace saccade
