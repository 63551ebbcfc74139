#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <vector>

#include "server/gl/gl_context.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/render/scene_painter.hpp"

namespace saccade {

/// Draws a scene as a camera sees it, distortion included, on a thread of its own. Any thread may
/// call; calls wait for each other.
class SceneView {
 public:
  /// `supersampling`: drawn pixels per camera pixel at the picture's centre. Errors of the context
  /// pass through.
  static absl::StatusOr<std::unique_ptr<SceneView>> Create(const CameraModel& camera,
                                                           GlBackend backend = GlBackend::kOsmesa,
                                                           double supersampling = 1.0);
  ~SceneView();

  /// Replaces what is drawn.
  absl::Status SetMeshes(std::vector<PlacedMesh> meshes);
  /// How what is virtual is lit, from the next Draw() on.
  void SetLight(const SceneLight& light);
  /// What is virtual from there: CV_8UC4, B G R A premultiplied by alpha, of the camera's size;
  /// alpha 0 where nothing virtual is, or something real is before it.
  absl::StatusOr<cv::Mat> Draw(const Rigid3& world_from_camera);

  static constexpr double kNear_m = 0.03, kFar_m = 200.0;

 private:
  struct Impl;
  explicit SceneView(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Drawn pixels per camera pixel that edges of what hides need, the fewer the larger the picture
/// is: 3 up to 640 x 480, 2 for 1280 x 720, never below 1.
double EnoughSupersampling(const CameraModel& camera);

/// Puts what SceneView drew over a picture of the same size, CV_8UC3.
void Blend(const cv::Mat& premultiplied_bgra, cv::Mat& bgr);

}  // namespace saccade
