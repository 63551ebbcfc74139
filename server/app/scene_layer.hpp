#pragma once

#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "server/gl/gl_context.hpp"
#include "server/pipeline/events.hpp"
#include "server/scene/scene_view.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade {

/// The scene as the augmented view shows it. Makes its view when there is first something to draw;
/// where there can be none it says so once on stderr and draws nothing. Thread safe; who draws at
/// the same time waits.
class SceneLayer {
 public:
  explicit SceneLayer(GlBackend backend) : backend_(backend) {}

  /// How light falls, as far as it is known.
  void SetLight(const SceneLight& light);
  SceneLight light() const {
    const std::lock_guard lock(light_mutex_);
    return light_;
  }
  /// SceneView::Draw; empty where there is nothing to draw.
  cv::Mat Draw(const Scene& scene, const AnnotationList& annotations,
               std::span<const MarkerPose> markers, const CameraModel& camera,
               const Rigid3& world_from_camera);

 private:
  const GlBackend backend_;
  std::mutex mutex_;
  std::unique_ptr<SceneView> view_;
  CameraIntrinsics intrinsics_;  // of the view
  mutable std::mutex
      light_mutex_;  // not held while anything is drawn: the tracker waits for nobody
  SceneLight light_;
  bool failed_ = false;
  std::uint64_t revision_ = 0;
  std::vector<Rigid3> places_;  // as uploaded, of what is fixed to something
};

}  // namespace saccade
