#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include "saccade/v1/scene.pb.h"
#include "saccade/v1/tracking.pb.h"
#include "shared/scene/marker_pose.hpp"
#include "shared/scene/scene_light.hpp"
#include "shared/scene/scene_object.hpp"

/// Scene objects to and from messages, as to_proto.hpp and from_proto.hpp.
namespace saccade::wire {

v1::SceneObject ToProto(const SceneObject& object);
v1::SceneModelFacts ToProto(const SceneModel& model);
v1::SceneLight ToProto(const SceneLight& light);
v1::MarkerPose ToProto(const MarkerPose& marker);

/// Numbers are finite, enums known, ids UUIDs; sizes are the scene's to judge. `field` names the
/// message in errors.
absl::StatusOr<SceneObject> FromProto(const v1::SceneObject& message, absl::string_view field);
absl::StatusOr<SceneLight> FromProto(const v1::SceneLight& message, absl::string_view field);
absl::StatusOr<MarkerPose> FromProto(const v1::MarkerPose& message, absl::string_view field);

}  // namespace saccade::wire
