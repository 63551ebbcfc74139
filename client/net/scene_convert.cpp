#include "client/net/scene_convert.hpp"

#include <absl/strings/str_cat.h>

#include <utility>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/scene.hpp"

namespace saccade::net {

absl::StatusOr<ModelFacts> FromProto(const v1::SceneModelFacts& message) {
  absl::StatusOr<Eigen::Vector3d> size = wire::FromProto(message.size_m(), "size_m");
  if (!size.ok()) return size.status();
  return ModelFacts{message.id(), message.name(), message.triangles(), message.bytes(), *size};
}

absl::StatusOr<SceneChange> FromProto(const v1::SceneEvent& message) {
  SceneChange change{.revision = message.revision(),
                     .full = message.full(),
                     .upserted = {},
                     .removed_ids = {message.removed_ids().begin(), message.removed_ids().end()},
                     .added_models = {},
                     .light = {}};
  for (int i = 0; i < message.upserted_size(); ++i) {
    absl::StatusOr<SceneObject> object =
        wire::FromProto(message.upserted(i), absl::StrCat("scene.upserted[", i, "]"));
    if (!object.ok()) return object.status();
    change.upserted.push_back(*std::move(object));
  }
  for (const v1::SceneModelFacts& facts : message.added_models()) {
    absl::StatusOr<ModelFacts> model = FromProto(facts);
    if (!model.ok()) return model.status();
    change.added_models.push_back(*std::move(model));
  }
  absl::StatusOr<SceneLight> light = wire::FromProto(message.light(), "scene.light");
  if (!light.ok()) return light.status();
  change.light = *light;
  return change;
}

}  // namespace saccade::net
