#pragma once

#include <absl/status/statusor.h>

#include "client/net/scene_types.hpp"
#include "saccade/v1/scene.pb.h"

/// Messages about the scene to domain types. Pure functions, any thread.
namespace saccade::net {

absl::StatusOr<ModelFacts> FromProto(const v1::SceneModelFacts& message);
absl::StatusOr<SceneChange> FromProto(const v1::SceneEvent& message);

}  // namespace saccade::net
