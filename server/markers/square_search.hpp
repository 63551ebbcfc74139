#pragma once

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// Where a square should be seen, and how surely.
struct SquareGuess {
  /// Of its corners, either way round [px, distorted].
  std::array<Eigen::Vector2d, 4> corners;
  std::array<Eigen::Matrix2d, 4> covariances;  // of these [px^2]
};

/// A corner where two fitted lines meet.
struct SearchedCorner {
  Eigen::Vector2d pixel;       // [px, distorted]
  Eigen::Matrix2d covariance;  // from the fits of both lines [px^2]
};

struct SquareSearch {
  /// In the order of the guess; one is missing where one of its lines is.
  std::array<std::optional<SearchedCorner>, 4> corners;
  int lines = 0;  // found
  int found() const;
};

/// Koller's measurement of a square that is known about (VRST 1997, 4.2; slam-spec 7): on each side
/// of it, 5 to 10 one-dimensional searches for the step from bright paper to dark border, along the
/// nearest of 8 directions and as far as the guess is uncertain; a line through the places found,
/// without outliers, with its covariance; corners where lines meet. Nothing where the inside is
/// even, as of what is held before it. `grey` is CV_8UC1.
SquareSearch SearchSquare(const cv::Mat& grey, const CameraModel& camera, const SquareGuess& guess);

/// The same again around what was found, until it stays: for guesses that are far off. Two rounds.
SquareSearch SearchSquareTwice(const cv::Mat& grey, const CameraModel& camera,
                               const SquareGuess& guess);

}  // namespace saccade
