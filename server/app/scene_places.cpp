#include "server/app/scene_places.hpp"

#include <algorithm>

#include "shared/models/shapes.hpp"
#include "shared/scene/object_place.hpp"

namespace saccade {

std::vector<PlacedMesh> PlacedMeshes(const Scene& scene, const AnnotationList& annotations,
                                     std::span<const MarkerPose> markers) {
  std::vector<PlacedMesh> meshes;
  for (const SceneObject& object : scene.objects) {
    const std::optional<Rigid3> pose = WorldFromObject(object, annotations, markers);
    if (!pose) continue;
    const std::shared_ptr<const SceneModel> model = scene.Model(object.model);
    meshes.push_back({std::make_shared<const TriangleMesh>(MeshOf(object, model.get())), *pose,
                      object.material});
  }
  return meshes;
}

CarriedSquareList CarriedOf(const Scene& scene) {
  CarriedSquareList all;
  for (const SceneObject& object : scene.objects) {
    const CarriedSquare one{object.marker_family, static_cast<int>(object.marker_id),
                            object.marker_side_m};
    const auto same = [&one](const CarriedSquare& other) {
      return other.family == one.family && other.id == one.id;
    };
    if (object.parent != SceneParent::kMarker || std::ranges::any_of(all, same)) continue;
    all.push_back(one);
  }
  return all;
}

std::shared_ptr<const Sight> SightOf(const Scene& scene) {
  std::vector<TriangleMesh> meshes;
  for (const SceneObject& object : scene.objects) {
    if (object.material != SceneMaterial::kReal || object.parent != SceneParent::kWorld) continue;
    Append(MeshOf(object, scene.Model(object.model).get()), object.parent_from_object, 1.0,
           meshes.emplace_back());
  }
  return meshes.empty() ? nullptr : std::make_shared<const Sight>(meshes);
}

}  // namespace saccade
