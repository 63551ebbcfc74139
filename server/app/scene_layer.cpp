#include "server/app/scene_layer.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/app/scene_keeper.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

bool SameLens(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.model == b.model && a.width == b.width && a.height == b.height && a.fx == b.fx &&
         a.fy == b.fy && a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion;
}

}  // namespace

void SceneLayer::SetLight(const SceneLight& light) {
  const std::lock_guard lock(light_mutex_);
  light_ = light;
}

cv::Mat SceneLayer::Draw(const Scene& scene, const AnnotationList& annotations,
                         const CameraModel& camera, const Rigid3& world_from_camera) {
  const bool visible = std::any_of(
      scene.objects.begin(), scene.objects.end(),
      [](const SceneObject& object) { return object.material != SceneMaterial::kReal; });
  const std::lock_guard lock(mutex_);
  if (!visible || failed_) return {};
  const auto give_up = [this](const absl::Status& why) {
    failed_ = true;
    view_ = nullptr;
    Log(absl::StrCat("the scene is not drawn: ", why.message()));
    return cv::Mat();
  };
  // A lens that is learnt changes while the server runs.
  if (view_ == nullptr || !SameLens(intrinsics_, camera.intrinsics())) {
    revision_ = 0;
    absl::StatusOr<std::unique_ptr<SceneView>> made =
        SceneView::Create(camera, backend_, EnoughSupersampling(camera));
    if (!made.ok()) return give_up(made.status());
    view_ = *std::move(made);
    intrinsics_ = camera.intrinsics();
  }
  if (revision_ != scene.revision || moves_) {
    absl::Status set = view_->SetMeshes(PlacedMeshes(scene, annotations));
    if (!set.ok()) return give_up(set);
    revision_ = scene.revision;
    moves_ = std::any_of(scene.objects.begin(), scene.objects.end(),
                         [](const SceneObject& one) { return one.parent != SceneParent::kWorld; });
  }
  view_->SetLight(light());
  absl::StatusOr<cv::Mat> drawn = view_->Draw(world_from_camera);
  if (!drawn.ok()) return give_up(drawn.status());
  return *std::move(drawn);
}

}  // namespace saccade
