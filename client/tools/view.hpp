#pragma once

#include <Eigen/Dense>
#include <memory>
#include <optional>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade::tools {

/// Somewhere to look from: the wearer's camera at one frame, or the eye above the 3D map.
struct View {
  std::shared_ptr<const CameraModel> camera;
  Rigid3 world_from_camera;
  Rigid3 camera_from_world;

  View() = default;
  View(std::shared_ptr<const CameraModel> lens, const Rigid3& pose)
      : camera(std::move(lens)), world_from_camera(pose), camera_from_world(pose.Inverse()) {}

  const Eigen::Vector3d& eye() const { return world_from_camera.translation; }
  /// Where a point appears [px]; nothing if it does not. May lie outside the picture.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point_in_world) const {
    return camera->Project(camera_from_world * point_in_world);
  }
  /// Distance in front of the eye [m]; negative behind.
  double Depth(const Eigen::Vector3d& point_in_world) const {
    return (camera_from_world * point_in_world).z();
  }
  /// Unit direction in world of a pixel's ray, whose origin is the eye; nothing outside the lens.
  std::optional<Eigen::Vector3d> Ray(const Eigen::Vector2d& pixel) const {
    const std::optional<Eigen::Vector3d> bearing = camera->Unproject(pixel);
    if (!bearing) return std::nullopt;
    return Eigen::Vector3d(world_from_camera.rotation * *bearing);
  }
};

/// A pinhole without distortion whose picture is `width` x `height` pixels.
/// `field_of_view_rad`: from top to bottom.
inline std::shared_ptr<const CameraModel> PinholeOf(int width, int height,
                                                    double field_of_view_rad) {
  CameraIntrinsics lens;
  lens.width = width;
  lens.height = height;
  lens.fx = lens.fy = 0.5 * height / std::tan(0.5 * field_of_view_rad);
  lens.cx = 0.5 * width - 0.5;
  lens.cy = 0.5 * height - 0.5;
  return std::make_shared<const CameraModel>(lens);
}

}  // namespace saccade::tools
