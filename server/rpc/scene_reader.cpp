#include "server/rpc/scene_reader.hpp"

#include <absl/container/flat_hash_map.h>

#include <string>

#include "shared/wire/scene.hpp"

namespace saccade {

bool SceneReader::Next(const std::shared_ptr<const Scene>& scene, v1::SceneEvent& event) {
  // Two who publish at once may come here in either order.
  if (told_ != nullptr && scene->revision <= told_->revision) return false;
  event.set_revision(scene->revision);
  event.set_full(told_ == nullptr);
  absl::flat_hash_map<std::string, std::string> before;  // bytes by id
  if (told_ != nullptr) {
    for (const SceneObject& object : told_->objects) {
      before[object.id] = wire::ToProto(object).SerializeAsString();
    }
  }
  for (const SceneObject& object : scene->objects) {
    v1::SceneObject message = wire::ToProto(object);
    const auto old = before.find(object.id);
    const bool same = old != before.end() && old->second == message.SerializeAsString();
    if (old != before.end()) before.erase(old);
    if (!same) *event.add_upserted() = std::move(message);
  }
  for (const auto& [id, bytes] : before) event.add_removed_ids(id);
  for (const auto& model : scene->models) {
    if (told_ != nullptr && told_->Model(model->id) != nullptr) continue;
    *event.add_added_models() = wire::ToProto(*model);
  }
  told_ = scene;
  return true;
}

}  // namespace saccade
