#pragma once

#include <Eigen/Dense>
#include <array>
#include <optional>

namespace saccade {

/// Lens models of `camera.yaml` (slam-spec section 4).
enum class LensModel { kPinhole, kRadial1, kBrownConrady, kKannalaBrandt, kFov };

/// Intrinsics of one camera. Pixel (0, 0) is the centre of the top-left pixel.
///
/// `distortion` by model: radial1 {k1 [px^-2]}, with u_d = u / sqrt(1 + 2 k1 |u|^2) in pixels from
/// (cx, cy); brown_conrady {k1 k2 p1 p2 k3} (OpenCV order); kannala_brandt {k1 k2 k3 k4}; fov {w
/// [rad]}, w above 0 and below pi; pinhole none.
struct CameraIntrinsics {
  LensModel model = LensModel::kPinhole;
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  // [px]
  std::array<double, 5> distortion{};
  double fps = 30.0;
  double rolling_shutter_readout_s = 0.0;  // 0: global shutter or unknown
};

/// Maps points in the camera frame (x right, y down, z forward, metres) to distorted pixels and
/// back.
class CameraModel {
 public:
  CameraModel() = default;
  /// Precomputes the radius up to which the distortion is monotonic (and so invertible).
  explicit CameraModel(const CameraIntrinsics& intrinsics);

  const CameraIntrinsics& intrinsics() const { return intrinsics_; }
  int width() const { return intrinsics_.width; }
  int height() const { return intrinsics_.height; }

  /// Pixel of `point_in_camera` [m], or nothing if it lies behind the camera or outside the part of
  /// the view where the distortion is invertible. May lie outside the image.
  /// `d_pixel_d_point`, if given, receives the 2 x 3 Jacobian [px/m].
  std::optional<Eigen::Vector2d> Project(
      const Eigen::Vector3d& point_in_camera,
      Eigen::Matrix<double, 2, 3>* d_pixel_d_point = nullptr) const;

  /// Unit bearing in the camera frame of a distorted pixel; nothing where not invertible.
  /// `d_bearing_d_pixel`, if given, receives the 3 x 2 Jacobian [1/px].
  /// Accurate to 1e-6 px when projected again (T10).
  std::optional<Eigen::Vector3d> Unproject(
      const Eigen::Vector2d& pixel, Eigen::Matrix<double, 3, 2>* d_bearing_d_pixel = nullptr) const;

  /// True if `pixel` is at least `border_px` inside the image.
  bool InImage(const Eigen::Vector2d& pixel, double border_px = 0.0) const {
    return pixel.x() >= border_px && pixel.y() >= border_px &&
           pixel.x() <= width() - 1 - border_px && pixel.y() <= height() - 1 - border_px;
  }

  /// Radians seen by one pixel at the picture's centre: 1 / mean focal length.
  double RadiansPerPixel() const { return 2.0 / (intrinsics_.fx + intrinsics_.fy); }

 private:
  CameraIntrinsics intrinsics_;
  double max_radius_ = 0.0;  // of the undistorted point, in the model's own unit
};

}  // namespace saccade
