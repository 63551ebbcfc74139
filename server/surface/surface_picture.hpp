#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "server/capture/frame.hpp"

namespace saccade {

/// A camera without distortion: pixel = focal_px * (x, y) / z + (cx, cy). (0, 0) is the centre of
/// the top-left pixel.
struct Pinhole {
  int width = 0, height = 0;
  float focal_px = 1.0f, cx = 0.0f, cy = 0.0f;

  Eigen::Vector3f Ray(float x, float y) const {  // z is 1
    return {(x - cx) / focal_px, (y - cy) / focal_px, 1.0f};
  }
};

/// A frame as a small pinhole camera would have taken it.
struct SurfacePicture {
  Pinhole camera;
  cv::Mat grey;   // CV_32FC1; below 0 where the lens did not see
  cv::Mat color;  // CV_8UC3 BGR
};

/// Takes the lens out of frames, once each, and makes them small. One thread at a time.
class Rectifier {
 public:
  explicit Rectifier(int width_px) : width_px_(width_px) {}

  /// 1 to 2 ms for 640x480.
  SurfacePicture Rectify(const Frame& frame);

 private:
  void Prepare(const std::shared_ptr<const CameraModel>& camera);

  const int width_px_;
  std::shared_ptr<const CameraModel> lens_;  // that the maps are of
  Pinhole camera_;
  cv::Mat map_x_, map_y_;  // of the half-shrunk picture
  cv::Size middle_;
  cv::Mat unseen_;
};

}  // namespace saccade
