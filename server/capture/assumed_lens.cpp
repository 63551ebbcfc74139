#include "server/capture/assumed_lens.hpp"

#include <cmath>
#include <numbers>

namespace saccade {

CameraIntrinsics AssumedLens(cv::Size size, bool turned, double fps) {
  CameraIntrinsics lens;
  lens.width = size.width;
  lens.height = size.height;
  const int across = turned ? size.height : size.width;
  lens.fx = lens.fy = 0.5 * across / std::tan(0.5 * kAssumedView_deg * std::numbers::pi / 180.0);
  lens.cx = 0.5 * (size.width - 1);
  lens.cy = 0.5 * (size.height - 1);
  if (fps > 0) lens.fps = fps;
  return lens;
}

}  // namespace saccade
