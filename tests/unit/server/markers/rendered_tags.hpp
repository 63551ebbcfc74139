#pragma once

#include <opencv2/core.hpp>

#include "server/markers/tag_family.hpp"
#include "server/markers/tag_grid.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A sheet of tags as it is printed, with the small squares between them, on white.
class RenderedSheet {
 public:
  RenderedSheet(const TagGrid& grid, const TagFamily& family);

  /// The sheet as `camera` sees it: each pixel the mean of sixteen rays, then Gaussian noise of
  /// `noise` grey levels. Beside the sheet is a grey wall.
  cv::Mat Seen(const CameraModel& camera, const Rigid3& camera_from_grid, double noise,
               unsigned seed) const;

 private:
  double ShadeAt(double x_m, double y_m) const;

  TagGrid grid_;
  double cell_m_ = 0;
  std::vector<cv::Mat> tags_;  // cells, 0 or 1, by id
};

/// A sheet one metre and a half before the camera, turned by these angles about its middle [rad].
Rigid3 FacingSheet(const TagGrid& grid, double distance_m, double yaw, double pitch, double roll);

}  // namespace saccade
