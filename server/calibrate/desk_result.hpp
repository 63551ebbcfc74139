#pragma once

#include <memory>
#include <string>

#include "server/calibrate/live_calibration.hpp"
#include "server/capture/frame.hpp"
#include "server/pipeline/calibration.hpp"

namespace saccade {

/// A report as services tell it; of its corners' errors at most 2000.
std::shared_ptr<const CalibrationResult> DeskResultOf(const LensReport& report);

/// What was looked at, as services tell it: a JPEG of at most 800 pixels across.
std::shared_ptr<const CalibrationPicture> DeskPictureOf(const Frame& frame,
                                                        const LiveCalibration::Look& look);

/// As it is before the first picture.
CalibrationState DeskBegin(const std::string& target, const std::string& words);

}  // namespace saccade
