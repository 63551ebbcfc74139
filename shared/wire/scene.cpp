#include "shared/wire/scene.hpp"

#include <absl/strings/str_cat.h>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::wire {
namespace {

constexpr std::uint32_t kGrey = 0xb4b4b4ff;

absl::Status ReadKinds(const v1::SceneObject& message, absl::string_view field,
                       SceneObject& object) {
  if (message.shape() < v1::SCENE_SHAPE_PLANE || message.shape() > v1::SCENE_SHAPE_MODEL) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, ".shape: ", message.shape(), " is not known; give one"));
  }
  if (message.material() < v1::SCENE_MATERIAL_REAL ||
      message.material() > v1::SCENE_MATERIAL_HIDDEN) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, ".material: ", message.material(), " is not known; give one"));
  }
  object.shape = static_cast<SceneShape>(message.shape() - v1::SCENE_SHAPE_PLANE);
  object.material = static_cast<SceneMaterial>(message.material() - v1::SCENE_MATERIAL_REAL);
  return absl::OkStatus();
}

}  // namespace

v1::SceneObject ToProto(const SceneObject& object) {
  v1::SceneObject message;
  message.set_id(object.id);
  message.set_name(object.name);
  message.set_shape(
      static_cast<v1::SceneShape>(static_cast<int>(object.shape) + v1::SCENE_SHAPE_PLANE));
  message.set_material(
      static_cast<v1::SceneMaterial>(static_cast<int>(object.material) + v1::SCENE_MATERIAL_REAL));
  if (object.shape == SceneShape::kModel) {
    message.set_model_id(object.model);
    message.set_scale(object.scale);
  } else {
    *message.mutable_size_m() = ToProto(object.size_m);
    message.set_color_rgba(object.color_rgba);
  }
  message.set_annotation_id(object.annotation_id);
  *message.mutable_parent_from_object() = ToProto(object.parent_from_object);
  return message;
}

v1::SceneLight ToProto(const SceneLight& light) {
  v1::SceneLight message;
  message.set_level(light.level);
  *message.mutable_toward_in_world() = ToProto(light.toward_in_world);
  message.set_confidence(light.confidence);
  return message;
}

v1::SceneModelFacts ToProto(const SceneModel& model) {
  v1::SceneModelFacts message;
  message.set_id(model.id);
  message.set_name(model.name);
  message.set_triangles(static_cast<std::uint32_t>(model.mesh.triangles.size()));
  message.set_bytes(static_cast<std::uint32_t>(model.file->size()));
  Eigen::Vector3f low = Eigen::Vector3f::Constant(1e9f), high = -low;
  for (const Eigen::Vector3f& p : model.mesh.positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  *message.mutable_size_m() = ToProto(Eigen::Vector3d((high - low).cast<double>()));
  return message;
}

absl::StatusOr<SceneObject> FromProto(const v1::SceneObject& message, absl::string_view field) {
  SceneObject object;
  const auto at = [&](const char* name) { return absl::StrCat(field, ".", name); };
  if (!message.id().empty()) {
    if (absl::Status uuid = CheckUuid(message.id(), at("id")); !uuid.ok()) return uuid;
  }
  if (absl::Status name = CheckText(message.name(), 100, at("name")); !name.ok()) return name;
  if (absl::Status kinds = ReadKinds(message, field, object); !kinds.ok()) return kinds;
  object.id = message.id();
  object.name = message.name();
  if (object.shape == SceneShape::kModel) {
    object.model = message.model_id();
    object.scale = message.scale() == 0 ? 1.0 : message.scale();
  } else {
    absl::StatusOr<Eigen::Vector3d> size = FromProto(message.size_m(), at("size_m"));
    if (!size.ok()) return size.status();
    object.size_m = *size;
    object.color_rgba = message.color_rgba() == 0 ? kGrey : message.color_rgba();
  }
  if (!message.annotation_id().empty()) {
    absl::Status uuid = CheckUuid(message.annotation_id(), at("annotation_id"));
    if (!uuid.ok()) return uuid;
    object.parent = SceneParent::kAnchor;
    object.annotation_id = message.annotation_id();
  }
  if (!message.has_parent_from_object()) return object;
  absl::StatusOr<Rigid3> pose = FromProto(message.parent_from_object(), at("parent_from_object"));
  if (!pose.ok()) return pose.status();
  object.parent_from_object = *pose;
  return object;
}

}  // namespace saccade::wire
