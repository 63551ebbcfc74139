#pragma once

#include <algorithm>
#include <optional>

#include "server/anchors/beside_views.hpp"

namespace saccade {

/// What is seen within a few pixels of a click: one surface, or two, one before the other.
struct DepthLayers {
  double range_m = 0.0;  // of the surface that most of it shows, along the clicked ray
  double sigma_m = 0.0;
  double other_share = 0.0;  // how much of it lies on another surface; 0: nothing
  double other_range_m = 0.0;
  double other_from_px = 0.0;  // how near to the click that is seen
  /// How far from the click, on every side, something was seen [px]. Where a side is bare, what is
  /// bare shows the depth of what is beside it, half a window far: an outline before a plain wall
  /// looks like one surface.
  double reach_px = 0.0;
  bool on_outline() const { return other_share > 0.0; }
  double nearer_m() const { return on_outline() ? std::min(range_m, other_range_m) : range_m; }
};

/// Looks for an outline at a click: the pixels around it are compared each with where they would
/// show in other frames of the last seconds, seen from beside, at many ranges about `guess_m`
/// (plane sweep, Collins 1996, with a small window a pixel). Inverse depth over one flat surface is
/// affine in the pixel; what does not fit lies on another surface.
///
/// A feature or patch on an outline is half one thing, half the other: its depth is that of neither
/// or of either, and whoever measures it well does not notice. Nothing if too few pixels have a
/// depth: no texture, or the camera has not moved sideways. Uses the poses that were published with
/// each frame. Any thread; some milliseconds.
std::optional<DepthLayers> ProbeLayers(const PastFrame& clicked, const Eigen::Vector2d& pixel,
                                       double guess_m, FrameId newest, const FrameLookup& frames,
                                       const PoseTrail* trail = nullptr);

}  // namespace saccade
