#include "server/capture/assumed_lens.hpp"

#include <absl/strings/str_format.h>

#include <cmath>
#include <numbers>

namespace saccade {

CameraIntrinsics AssumedLens(cv::Size size, bool turned, double fps, double view_deg) {
  CameraIntrinsics lens;
  lens.width = size.width;
  lens.height = size.height;
  const int across = turned ? size.height : size.width;
  lens.fx = lens.fy = 0.5 * across / std::tan(0.5 * view_deg * std::numbers::pi / 180.0);
  lens.cx = 0.5 * (size.width - 1);
  lens.cy = 0.5 * (size.height - 1);
  if (fps > 0) lens.fps = fps;
  return lens;
}

std::string AssumedLensWords(double view_deg) {
  return absl::StrFormat(
      "lens assumed: %.4g deg wide, no distortion, not metric; it is learnt while tracking; "
      "better: "
      "give --camera camera.yaml",
      view_deg);
}

}  // namespace saccade
