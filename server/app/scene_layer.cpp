#include "server/app/scene_layer.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/app/scene_places.hpp"
#include "shared/io/log.hpp"
#include "shared/scene/object_place.hpp"

namespace saccade {
namespace {

bool SameLens(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.model == b.model && a.width == b.width && a.height == b.height && a.fx == b.fx &&
         a.fy == b.fy && a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion;
}

/// Where things are that are fixed to something; far away: nobody knows.
std::vector<Rigid3> PlacesOfMoved(const Scene& scene, const AnnotationList& annotations,
                                  std::span<const MarkerPose> markers) {
  constexpr double kNowhere_m = 1e9;
  std::vector<Rigid3> places;
  for (const SceneObject& object : scene.objects) {
    if (object.parent == SceneParent::kWorld) continue;
    places.push_back(
        WorldFromObject(object, annotations, markers)
            .value_or(Rigid3{Eigen::Quaterniond::Identity(), Eigen::Vector3d(kNowhere_m, 0, 0)}));
  }
  return places;
}

bool SamePlaces(const std::vector<Rigid3>& a, const std::vector<Rigid3>& b) {
  return std::ranges::equal(a, b, [](const Rigid3& one, const Rigid3& other) {
    return one.translation == other.translation && one.rotation.coeffs() == other.rotation.coeffs();
  });
}

}  // namespace

void SceneLayer::SetLight(const SceneLight& light) {
  const std::lock_guard lock(light_mutex_);
  light_ = light;
}

cv::Mat SceneLayer::Draw(const Scene& scene, const AnnotationList& annotations,
                         std::span<const MarkerPose> markers, const CameraModel& camera,
                         const Rigid3& world_from_camera) {
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
  std::vector<Rigid3> places = PlacesOfMoved(scene, annotations, markers);
  if (revision_ != scene.revision || !SamePlaces(places, places_)) {
    absl::Status set = view_->SetMeshes(PlacedMeshes(scene, annotations, markers));
    if (!set.ok()) return give_up(set);
    revision_ = scene.revision;
    places_ = std::move(places);
  }
  view_->SetLight(light());
  absl::StatusOr<cv::Mat> drawn = view_->Draw(world_from_camera);
  if (!drawn.ok()) return give_up(drawn.status());
  return *std::move(drawn);
}

}  // namespace saccade
