#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "server/calibrate/picture_set.hpp"
#include "server/markers/wall_squares.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// One view of squares that do not lie in one plane.
struct WallsView {
  std::string name;
  std::vector<cv::Point3f> points;  // [m, world]
  std::vector<cv::Point2f> pixels;
  double rms_px = 0;  // length of the errors
};

struct WallsFit {
  CameraIntrinsics lens;
  double focal_sigma_px = 0, centre_sigma_px = 0, k1_sigma = 0;  // k1_sigma 0: taken for none
  double rms_px = 0;
  std::vector<WallsView> views;
};

/// A lens from one view of known squares on two walls, or from several: each view's projection
/// matrix by DLT, taken apart, then least squares over lens and poses (Weng, Cohen, Herniou 1992);
/// square pixels, k1 where it explains enough. Leaves out, and names on stderr, what shows too few
/// squares. FailedPrecondition: no view is of use, or no lens explains them.
absl::StatusOr<WallsFit> FitWalls(const PictureSet& pictures, const WallSquares& walls,
                                  int border_bits);

/// For people, for programs, and for the head of camera.yaml.
std::string WallsText(const WallsFit& fit);
nlohmann::ordered_json WallsJson(const WallsFit& fit);

}  // namespace saccade
