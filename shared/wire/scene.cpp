#include "shared/wire/scene.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::wire {
namespace {

constexpr std::uint32_t kGrey = 0xb4b4b4ff;

absl::Status ReadParent(const v1::SceneObject& message, absl::string_view field,
                        SceneObject& object) {
  if (message.has_marker() && !message.annotation_id().empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, ": has both marker and annotation_id; give one"));
  }
  if (message.has_marker()) {
    object.parent = SceneParent::kMarker;
    object.marker_family = message.marker().family();
    object.marker_id = message.marker().id();
    object.marker_side_m = message.marker().side_m();
    return CheckText(object.marker_family, 100, absl::StrCat(field, ".marker.family"));
  }
  if (message.annotation_id().empty()) return absl::OkStatus();
  object.parent = SceneParent::kAnchor;
  object.annotation_id = message.annotation_id();
  return CheckUuid(message.annotation_id(), absl::StrCat(field, ".annotation_id"));
}

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
  if (object.parent == SceneParent::kMarker) {
    message.mutable_marker()->set_family(object.marker_family);
    message.mutable_marker()->set_id(object.marker_id);
    message.mutable_marker()->set_side_m(object.marker_side_m);
  }
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

v1::MarkerPose ToProto(const MarkerPose& marker) {
  v1::MarkerPose message;
  message.set_family(marker.family);
  message.set_id(marker.id);
  *message.mutable_world_from_marker() = ToProto(marker.world_from_marker);
  message.set_seen_ns(marker.seen_ns);
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
  if (absl::Status parent = ReadParent(message, field, object); !parent.ok()) return parent;
  if (!message.has_parent_from_object()) return object;
  absl::StatusOr<Rigid3> pose = FromProto(message.parent_from_object(), at("parent_from_object"));
  if (!pose.ok()) return pose.status();
  object.parent_from_object = *pose;
  return object;
}

absl::StatusOr<SceneLight> FromProto(const v1::SceneLight& message, absl::string_view field) {
  SceneLight light{.level = message.level(), .confidence = message.confidence()};
  const bool number = std::isfinite(light.level) && std::isfinite(light.confidence);
  if (!number) return absl::InvalidArgumentError(absl::StrCat(field, ": is not finite"));
  if (!message.has_toward_in_world()) return light;
  absl::StatusOr<Eigen::Vector3d> toward =
      FromProto(message.toward_in_world(), absl::StrCat(field, ".toward_in_world"));
  if (!toward.ok()) return toward.status();
  light.toward_in_world = *toward;
  return light;
}

absl::StatusOr<MarkerPose> FromProto(const v1::MarkerPose& message, absl::string_view field) {
  absl::StatusOr<Rigid3> pose =
      FromProto(message.world_from_marker(), absl::StrCat(field, ".world_from_marker"));
  if (!pose.ok()) return pose.status();
  return MarkerPose{message.family(), message.id(), *pose, message.seen_ns()};
}

}  // namespace saccade::wire
