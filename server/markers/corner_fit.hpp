#pragma once

#include <Eigen/Dense>
#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "server/markers/marker.hpp"

namespace saccade {

/// A corner to a fraction of a pixel.
struct CornerFit {
  Eigen::Vector2d pixel;    // [px]
  double variance_px2 = 0;  // along its worst axis
};

/// The point near `start` that all gradients within `reach_px` of it are perpendicular to the way
/// to (Foerstner); nothing if it is further than `reach_px` from `start`, too near the picture's
/// edge, or not determined. Works for a corner of a square and where two squares meet.
std::optional<CornerFit> FitCorner(const cv::Mat& grey, const Eigen::Vector2d& start, int reach_px);

/// Whether four fields meet at `pixel`, dark and bright in turn, and not one corner in a bright
/// surround: as between the tags of an AprilGrid.
bool IsSaddle(const cv::Mat& grey, const Eigen::Vector2d& pixel, double radius_px);

/// Refines the corners that are saddles where they are. Those of lone squares, of which a gradient
/// fit is drawn inwards, become where lines along the border meet, if the shortest side has at
/// least `least_side_px`; else, and where there are no such lines, they stay. Gives all a variance:
/// of those that stay, `kept_variance_px2` or what the gradients about them say, what is more.
void RefineCorners(const cv::Mat& grey, double least_side_px, double kept_variance_px2,
                   MarkerSighting& sighting);

/// How far from a corner of a square with this side its surroundings are its own [px].
int CornerReach(double side_px);

}  // namespace saccade
