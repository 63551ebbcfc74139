#pragma once

#include <absl/status/statusor.h>

#include <stop_token>
#include <string>

#include "server/calibrate/lens_report.hpp"
#include "server/capture/camera_text.hpp"

namespace saccade {

struct LensWish {
  std::string lens;                                // brown_conrady, kannala_brandt; empty: either
  CameraTextForm form = CameraTextForm::kSaccade;  // Kalibr's has no k3
  bool hold_out = true;                            // every fifth view, to hold the fit against
  std::stop_token stop = {};  // gives up soon: the result is worth nothing then
};

/// By the lens that is wished for, or of both by the one that says more about the views (Bayes'
/// information criterion). Errors as FitLens.
absl::StatusOr<LensReport> FitBest(const std::string& source, const ViewPicker& picker,
                                   const std::string& target, cv::Size picture,
                                   const LensWish& wish);

}  // namespace saccade
