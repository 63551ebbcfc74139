#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "server/features/corner_detector.hpp"
#include "server/features/image_pyramid.hpp"
#include "server/features/patch.hpp"

namespace saccade {

/// Smoothed noise of two grain sizes at 640 x 480, seen through a Brown-Conrady lens. Corners
/// everywhere, so detection and search have the most to do.
struct TexturedScene {
  TexturedScene();

  cv::Mat image;
  ImagePyramid pyramid;
  std::shared_ptr<const CameraModel> camera;
  std::vector<Corner> corners;         // 100
  std::vector<PatchTemplate> patches;  // one for each corner
};

/// The one scene of all benchmarks; made when first asked for.
const TexturedScene& TheScene();

}  // namespace saccade
