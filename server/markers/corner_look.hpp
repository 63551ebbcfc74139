#pragma once

#include <absl/strings/string_view.h>

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>

#include "server/markers/square_search.hpp"

namespace saccade {

/// Width of the black border of a family's markers, of their side.
double BorderShare(absl::string_view family);

/// What there is to be seen of a square's corners, in the order of the guess.
struct CornerLook {
  /// Dark border inside and bright paper outside along both sides that meet there: the corner of a
  /// square, and not that of something held before it.
  std::array<bool, 4> seen{};
  double paper = 0.0;  // level of the paper about the corners that are seen, 0: none is [grey]
};

/// Looks at the profile of the border's edge beside each corner: where `search` has found it, else
/// where it must be by those that were found, else where the guess is. Bright and dark are taken
/// from the corner's own surroundings, so shadows across the square do not matter. `grey`: CV_8UC1.
CornerLook LookAtCorners(const cv::Mat& grey, const SquareGuess& guess, const SquareSearch& search,
                         double border_share);

}  // namespace saccade
