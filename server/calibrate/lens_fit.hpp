#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <opencv2/core.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "server/calibrate/board.hpp"
#include "server/calibrate/lens_problem.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// Where the board was in one view, and how well it fits.
struct ViewFit {
  std::uint64_t frame = 0;
  cv::Vec3d rotation, translation_m;  // camera_from_board, rotation as axis times angle
  double rms_px = 0;                  // root of the mean square length of its corners' errors
  bool rejected = false;              // a bent, blurred or wrongly found board
  /// The board's normal in the camera: along +z if it is seen straight on.
  Eigen::Vector3d normal() const;
};

/// A lens and what is known of it.
struct CalibratedLens {
  CameraIntrinsics lens;
  /// fx fy cx cy and the model's coefficients, one standard deviation each, from the residuals: the
  /// larger of what independent corners and what independent views say.
  std::vector<std::string> names;
  Eigen::VectorXd values, sigmas;
  std::vector<ViewFit> views;  // as given
  double rms_px = 0;           // over the views that were not rejected
};

/// Fits the chosen lens to views of the board: least squares with Huber's
/// weights over the lens and a pose for each view; views that fit far worse than the others are
/// left out. `stop` gives up soon. FailedPrecondition: no lens explains them; what to look at.
absl::StatusOr<CalibratedLens> FitLens(const std::vector<BoardView>& views, cv::Size picture,
                                       LensChoice choice, std::stop_token stop = {});

/// The pose of the board in a view that had no part in the fit, with the lens held.
ViewFit FitView(const BoardView& view, const CalibratedLens& fit);

}  // namespace saccade
