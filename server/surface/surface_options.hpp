#pragma once

#include <absl/status/status.h>

#include <cstddef>

namespace saccade {

/// How surfaces are found and kept. Lengths "of the distance" are shares of what is typically in
/// view, so that maps without metres work alike.
struct SurfaceOptions {
  int width_px = 160;  // of depth maps: a quarter of 640

  // Keyframes and the views that they are compared with.
  double apart_share = 0.04;           // of the distance, or...
  double apart_rad = 0.10;             // ...so much turned: another keyframe
  double depth_apart = 1.6;            // times that: another depth; between them, views only
  int max_keyframes = 300;             // kept; 0.3 MB each
  int views = 6;                       // compared with each
  int fewest_views = 3;                // else its depth is not sought yet
  int newer_keyframes = 2;             // seen since: views from both sides
  double least_parallax_share = 0.03;  // baseline across the view, of the distance
  double best_parallax_share = 0.13;
  double most_parallax_share = 0.30;
  double most_turn_rad = 0.6;

  // The sweep: planes evenly in inverse depth between these, times 1 / distance.
  int planes = 80;
  double farthest_inverse = 0.15, nearest_inverse = 3.5;
  double least_deviation = 0.8;    // of a window [grey levels]; less has no texture
  double least_correlation = 0.3;  // mean over the better half of the views
  double least_lead = 0.02;        // of the summed cost, before any other depth

  // A depth counts if other keyframes, from elsewhere, agree.
  double agree_share = 0.025;  // of inverse depth
  int fewest_agreeing = 2;

  // Fusion.
  double voxel_m = 0.015;
  double voxel_share = 0.010;       // of the distance, where the map has no metres
  double truncation_voxels = 3.0;   // signed distance is known so far on both sides of a surface...
  double truncation_share = 0.02;   // ...or so much of the depth, if that is more
  std::size_t max_blocks = 30'000;  // of 8^3 voxels, 4 KB each: 120 MB
  double least_weight = 1.0;        // of a voxel, in looks from a near keyframe
  double moved_share = 0.010;       // of the distance: then a keyframe's depth is fused anew

  /// InvalidArgument names the field.
  absl::Status Validate() const;
};

}  // namespace saccade
