#pragma once

#include <memory>

#include "saccade/v1/scene.pb.h"
#include "shared/scene/scene_light.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade {

/// What one stream was told of the scene. Costs a pointer: scenes are shared. Not thread safe.
class SceneReader {
 public:
  /// Fills `event` with what `scene` (never null) has that the last one had not; all of it the
  /// first time; and with the light. False: nothing that was not told.
  bool Next(const std::shared_ptr<const Scene>& scene, const SceneLight& light,
            v1::SceneEvent& event);
  /// Whether somebody would see that it is another light than was told.
  bool IsOther(const SceneLight& light) const;

 private:
  std::shared_ptr<const Scene> told_;  // null: nothing yet
  SceneLight light_;                   // told
};

}  // namespace saccade
