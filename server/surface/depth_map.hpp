#pragma once

#include <span>

#include "server/surface/plane_sweep.hpp"
#include "server/surface/surface_options.hpp"

namespace saccade {

/// Depth along the optic axis of each pixel of a keyframe's small picture.
struct DepthMap {
  Pinhole camera;
  cv::Mat inverse_depth;  // CV_32FC1 [1 / map's unit when it was made]; 0: not known

  /// 0 outside.
  float At(int x, int y) const {
    if (x < 0 || y < 0 || x >= camera.width || y >= camera.height) return 0.0f;
    return inverse_depth.at<float>(y, x);
  }
  double KnownShare() const;
};

/// The depth of each pixel that has one: textured, correlated, and without a rival.
DepthMap FindDepth(const SurfacePicture& reference, std::span<const SweepView> views,
                   const SweepPlanes& planes, const SurfaceOptions& options);

/// Another keyframe's depth, and where it is.
struct OtherDepth {
  const DepthMap* depth = nullptr;
  float length_factor = 1.0f;  // of its lengths now, against when it was made
  Rigid3 other_from_this;
};

/// Leaves what `fewest_agreeing` others confirm and at most half as many contradict, by seeing
/// through it.
/// `length_factor`: of this depth's lengths. What no other could see stays out as well.
DepthMap KeepConfirmed(const DepthMap& depth, float length_factor,
                       std::span<const OtherDepth> others, const SurfaceOptions& options);

}  // namespace saccade
