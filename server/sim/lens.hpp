#pragma once

#include <opencv2/core.hpp>

#include "server/sim/scene_renderer.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// Turns a picture without distortion into what the camera's lens makes of it.
class Lens {
 public:
  /// `supersampling`: drawn pixels per camera pixel at the picture's centre.
  Lens(const CameraModel& camera, double supersampling);

  /// The view to draw: wide enough for every pixel of the camera.
  const PinholeView& view() const { return view_; }

  /// `drawn` is view().height x view().width, CV_8UC4; gives CV_8UC3 of the camera's size.
  void Apply(const cv::Mat& drawn, cv::Mat& bgr) const;

  /// The same of any pixels that cv::remap takes; what it shows keeps its type.
  void Bend(const cv::Mat& drawn, cv::Mat& bent) const;

  /// Where camera pixel (u, v) is in the drawn picture.
  Eigen::Vector2d DrawnFromCamera(const CameraModel& camera, const Eigen::Vector2d& pixel) const;

 private:
  PinholeView view_;
  cv::Mat map_, map_fraction_;  // fixed point, for cv::remap
};

}  // namespace saccade
