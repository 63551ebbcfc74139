#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>

#include "server/markers/koller_code.hpp"

namespace saccade {

/// Reads the cells of a square whose border's `corners` are these, clockwise as seen [px].
/// `color` is CV_8UC3, BGR.
///   InvalidArgument  in words for a person: the frame is not black on white, a cell is neither
///                    clearly red nor clearly black (covered, in glare), or the cells are no code
absl::StatusOr<KollerReading> ReadKollerSquare(const cv::Mat& color,
                                               const std::array<Eigen::Vector2d, 4>& corners);

}  // namespace saccade
