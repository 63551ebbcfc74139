#include "server/rpc/scene_reader.hpp"

#include <absl/container/flat_hash_map.h>

#include <cmath>
#include <string>

#include "shared/wire/scene.hpp"

namespace saccade {

namespace {

constexpr double kSeen = 0.03;  // of the brightness of what is lit

}  // namespace

bool SceneReader::IsOther(const SceneLight& light) const {
  const Eigen::Vector3d turn = light.toward_in_world - light_.toward_in_world;
  return std::abs(light.level - light_.level) > kSeen ||
         std::abs(light.confidence - light_.confidence) > kSeen || turn.norm() > kSeen;
}

bool SceneReader::Next(const std::shared_ptr<const Scene>& scene, const SceneLight& light,
                       v1::SceneEvent& event) {
  // Two who publish at once may come here in either order.
  const bool newer = told_ == nullptr || scene->revision > told_->revision;
  if (!newer && !IsOther(light)) return false;
  light_ = light;
  *event.mutable_light() = wire::ToProto(light);
  event.set_revision(newer ? scene->revision : told_->revision);
  if (!newer) return true;
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
