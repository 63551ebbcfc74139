#pragma once

#include <absl/status/status.h>

#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "server/calibrate/lens_fit.hpp"
#include "server/calibrate/view_picker.hpp"

namespace saccade {

/// Where a corner was seen, and from there to where the fit has it [px].
struct CornerError {
  double x = 0, y = 0, dx = 0, dy = 0;
};

/// A calibration with what speaks for it.
struct LensReport {
  std::string source;
  std::string board;  // in words, for the file
  CalibratedLens fit;
  std::vector<ViewFit> held_out;  // views that had no part in the fit
  double held_out_rms_px = 0;
  double covered = 0;               // share of the picture that corners were in
  std::vector<CornerError> errors;  // of the views fitted, without those rejected
  std::vector<int> counts;          // corners in each part of it, ViewPicker's
  int tilted_x = 0, tilted_y = 0;   // views whose normal leans so, by the lens found
};

/// The views are fitted; every fifth is held out where there are ten and `hold_out`.
absl::StatusOr<LensReport> Calibrate(const std::string& source, const ViewPicker& picker,
                                     const std::string& board, cv::Size picture, LensChoice choice,
                                     bool hold_out = true, std::stop_token stop = {});

/// Whether that is enough to be believed. FailedPrecondition: too few views or tilts, a focal
/// length or centre that the views do not determine, too little of the picture, other views that it
/// does not fit: what, and what to do about it.
absl::Status Judge(const LensReport& report);

/// For people: parameters with sigmas, residuals by view, the picture's parts.
std::string ReportText(const LensReport& report);
nlohmann::ordered_json ReportJson(const LensReport& report);
/// What camera.yaml says of how it was made: lines, the first `#` left out.
std::string CameraFileHeader(const LensReport& report);

}  // namespace saccade
