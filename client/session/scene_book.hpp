#pragma once

#include <cstdint>
#include <memory>

#include "client/net/scene_types.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade::session {

/// The scene as the stream tells it, with the models that have been fetched. One thread.
class SceneBook {
 public:
  void Apply(const net::SceneChange& change);
  void Add(std::shared_ptr<const SceneModel> model);

  const Scene& scene() const { return scene_; }
  const SceneLight& light() const { return light_; }
  /// Rises with every change but the light's.
  std::uint64_t version() const { return version_; }

 private:
  Scene scene_;
  SceneLight light_;
  std::uint64_t version_ = 0;
};

}  // namespace saccade::session
