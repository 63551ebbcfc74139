#include "client/net/scene_convert.hpp"

#include <absl/strings/str_cat.h>

#include <utility>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/scene.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::net {
namespace {

absl::StatusOr<Touch> TouchOf(const v1::SceneContact& message) {
  absl::StatusOr<Eigen::Vector3d> point =
      wire::FromProto(message.point_in_world_m(), "point_in_world_m");
  if (!point.ok()) return point.status();
  return Touch{message.object_id(), message.object_name(), *point, message.moved_m()};
}

}  // namespace

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

absl::StatusOr<PlacedThing> FromProto(const v1::PlaceSceneObjectResponse& message) {
  absl::StatusOr<SceneObject> at_rest = wire::FromProto(message.object(), "object");
  if (!at_rest.ok()) return at_rest.status();
  absl::StatusOr<Touch> support = TouchOf(message.support());
  if (!support.ok()) return support.status();
  PlacedThing placed{*std::move(at_rest), std::nullopt, *std::move(support)};
  if (!message.has_stop()) return placed;
  absl::StatusOr<Touch> stop = TouchOf(message.stop());
  if (!stop.ok()) return stop.status();
  placed.stop = *std::move(stop);
  return placed;
}

absl::StatusOr<RegisteredThing> FromProto(const v1::RegisterSceneObjectResponse& message) {
  absl::StatusOr<SceneObject> object = wire::FromProto(message.object(), "object");
  if (!object.ok()) return object.status();
  return RegisteredThing{
      *std::move(object),
      message.rms_mm(),
      message.left_out_rms_mm(),
      {message.errors_mm().begin(), message.errors_mm().end()},
      {message.left_out_errors_mm().begin(), message.left_out_errors_mm().end()}};
}

v1::PlaceSceneObjectRequest PlaceRequest(const SceneObject& object,
                                         const std::optional<Eigen::Vector3d>& push,
                                         const std::optional<Eigen::Vector3d>& gravity) {
  v1::PlaceSceneObjectRequest request;
  *request.mutable_object() = wire::ToProto(object);
  if (push) *request.mutable_push_in_world() = wire::ToProto(*push);
  if (gravity) *request.mutable_gravity_in_world() = wire::ToProto(*gravity);
  return request;
}

v1::RegisterSceneObjectRequest RegisterRequest(const std::string& id,
                                               const std::vector<PointPair>& pairs, bool with_scale,
                                               bool accept) {
  v1::RegisterSceneObjectRequest request;
  request.set_id(id);
  request.set_with_scale(with_scale);
  request.set_accept(accept);
  for (const PointPair& pair : pairs) {
    v1::SceneCorrespondence* one = request.add_correspondences();
    *one->mutable_point_in_object_m() = wire::ToProto(pair.in_object);
    *one->mutable_point_in_world_m() = wire::ToProto(pair.in_world);
  }
  return request;
}

}  // namespace saccade::net
