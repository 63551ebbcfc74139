#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "client/net/scene_types.hpp"
#include "saccade/v1/scene.pb.h"

/// Messages about the scene to domain types. Pure functions, any thread.
namespace saccade::net {

absl::StatusOr<ModelFacts> FromProto(const v1::SceneModelFacts& message);
absl::StatusOr<SceneChange> FromProto(const v1::SceneEvent& message);
absl::StatusOr<PlacedThing> FromProto(const v1::PlaceSceneObjectResponse& message);
absl::StatusOr<RegisteredThing> FromProto(const v1::RegisterSceneObjectResponse& message);

/// `push`: of any length; `gravity`: unit, nothing: +y.
v1::PlaceSceneObjectRequest PlaceRequest(const SceneObject& object,
                                         const std::optional<Eigen::Vector3d>& push,
                                         const std::optional<Eigen::Vector3d>& gravity);
/// `with_scale`: of a model alone; `accept`: it is moved there.
v1::RegisterSceneObjectRequest RegisterRequest(const std::string& id,
                                               const std::vector<PointPair>& pairs, bool with_scale,
                                               bool accept);

}  // namespace saccade::net
