#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shared/scene/scene_light.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade::net {

struct ModelFacts {
  std::string id, name;
  std::uint32_t triangles = 0, bytes = 0;
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
};

struct Touch {
  std::string object_id, object_name;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
  double moved_m = 0;
};
/// How a thing came to rest.
struct PlacedThing {
  SceneObject object;
  std::optional<Touch> stop;  // none: it was not pushed
  Touch support;
};

/// A point of an object, in its own frame (of a model before its scale), and the same in the map
/// [m].
struct PointPair {
  Eigen::Vector3d in_object, in_world;
};
/// Where an object lies by such pairs, and how far off each is: by all, and by the others alone.
struct RegisteredThing {
  SceneObject object;
  double rms_mm = 0, left_out_rms_mm = 0;
  std::vector<double> errors_mm, left_out_errors_mm;
};

/// What changed in the scene.
struct SceneChange {
  std::uint64_t revision = 0;
  bool full = false;  // forget what there was
  std::vector<SceneObject> upserted;
  std::vector<std::string> removed_ids;
  std::vector<ModelFacts> added_models;
  SceneLight light;
};

}  // namespace saccade::net
