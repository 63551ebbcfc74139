#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/surface/surface_picture.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// Another picture of what the reference shows.
struct SweepView {
  const SurfacePicture* picture = nullptr;
  Rigid3 view_from_reference;  // lengths in the map's unit
};

/// Planes that face the camera, evenly in inverse depth [1 / map's unit].
struct SweepPlanes {
  float first = 0.0f, step = 1.0f;  // inverse depth of plane k: first + k * step
  int count = 0;
};

/// How badly each pixel of the reference fits each plane.
struct CostVolume {
  static constexpr int kUnrelated = 127;  // as two windows that have nothing in common

  int width = 0, height = 0;
  SweepPlanes planes;
  std::vector<std::uint8_t> costs;  // [y][x][plane]: kUnrelated * (1 - correlation)
  cv::Mat deviation;                // CV_32FC1: of each pixel's window [grey levels]

  const std::uint8_t* At(int x, int y) const {
    return costs.data() + (static_cast<std::size_t>(y) * width + x) * planes.count;
  }
};

/// Compares windows of 5x5 pixels by normalised correlation with where they would show in `views`
/// if they lay on each plane: plane sweep, Collins, "A space-sweep approach to true multi-image
/// matching", CVPR 1996. A cost is the mean over the better half of the views: what is hidden from
/// one side is seen from the other (Kang, Szeliski and Chai, "Handling occlusions in dense
/// multi-view stereo", CVPR 2001).
///
/// 20 ms a view for 160x120 and 80 planes. At most 12 views.
CostVolume SweepViews(const SurfacePicture& reference, std::span<const SweepView> views,
                      const SweepPlanes& planes);

}  // namespace saccade
