#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/render/framebuffer.hpp"
#include "shared/render/scene_painter.hpp"

namespace saccade {

/// What a camera sees of a scene, as a pinhole's picture wide enough for its lens, and where each
/// of the camera's pixels is in it. Lives on the thread of its context, which must be current; `gl`
/// must outlive it.
class ScenePicture {
 public:
  static constexpr double kNear_m = 0.03, kFar_m = 200.0;

  /// `supersampling`: drawn pixels per camera pixel at the picture's centre.
  static absl::StatusOr<std::unique_ptr<ScenePicture>> Create(const GlFunctions& gl,
                                                              const CameraModel& camera,
                                                              double supersampling);

  /// Draws into a framebuffer of its own, which stays bound. B G R A, premultiplied, alpha 0 where
  /// nothing virtual is seen; the top row first; until the next call.
  absl::StatusOr<std::span<const std::uint8_t>> Draw(ScenePainter& painter,
                                                     const Rigid3& world_from_camera);
  int width() const { return target_->width(); }
  int height() const { return target_->height(); }

  /// Where a pixel of the camera is in what Draw() gave, as shares of its width and height; nothing
  /// outside the lens.
  std::optional<Eigen::Vector2d> ShareOf(const Eigen::Vector2d& pixel) const;

 private:
  explicit ScenePicture(const GlFunctions& gl) : gl_(gl) {}

  const GlFunctions& gl_;
  CameraModel camera_;
  double fx_ = 0, fy_ = 0, cx_ = 0, cy_ = 0;  // of the pinhole [px]
  std::unique_ptr<Framebuffer> target_;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace saccade
