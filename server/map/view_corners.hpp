#pragma once

#include <Eigen/Dense>
#include <opencv2/core.hpp>
#include <vector>

#include "server/map/picture_description.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// Corners of a picture that are no features of the map; their points are known once another
/// picture has shown them from elsewhere. One entry of each list per corner.
struct ViewCorners {
  std::vector<DescribedPoint> described;
  std::vector<Eigen::Vector3d> bearings;  // unit, camera
  std::vector<double> ranges_m;           // along the bearing; 0: not known
};

/// Places worth describing in `grey` [px]: denser than a tracker wants, so that they repeat.
std::vector<Eigen::Vector2d> PlacesToDescribe(const cv::Mat& grey, int count);

/// The `count` best corners of `grey`, none nearer than 5 px to `taken`.
ViewCorners DescribeCorners(const cv::Mat& grey, const CameraModel& camera,
                            const std::vector<Eigen::Vector2d>& taken, int count);

/// A picture's corners and where it was taken from.
struct CornerView {
  Rigid3 world_from_camera;
  ViewCorners* corners;
};

/// Matches corners of two pictures along their epipolar lines and sets the ranges of those that
/// have none: at least 2 deg of parallax, 1.5 px, ranges between `near_m` and `far_m`. Returns how
/// many places agreed. About 1 ms for 400 corners each.
int TriangulateCorners(const CameraModel& camera, const CornerView& first, const CornerView& second,
                       double near_m, double far_m);

}  // namespace saccade
