#pragma once

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/pipeline/commands.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade {

/// What a placed thing came to touch.
struct SceneContact {
  std::string object_id, object_name;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();    // [m]
  Eigen::Vector3d normal_in_world = Eigen::Vector3d::UnitY();  // unit, out of the object
  double moved_m = 0;
};
struct PlacedObject {
  SceneObject object;
  std::optional<SceneContact> stop;  // none: it was not pushed
  SceneContact support;
  double slid_m = 0;                       // along what stopped it
  std::optional<SceneContact> slide_stop;  // what it met while it slid
};
struct RegisteredObject {
  SceneObject object;
  double rms_m = 0, left_out_rms_m = 0;
  std::vector<double> errors_m, left_out_errors_m;
};

// What may be asked of the scene; `done` after the commit.
struct PutSceneObject {
  SceneObject object;  // id empty: a new one
  Done<SceneObject> done;
};
struct RemoveSceneObject {
  std::string id;
  DoneEmpty done;
};
struct PlaceSceneObject {
  SceneObject object;
  std::optional<Eigen::Vector3d> push;
  Eigen::Vector3d gravity = Eigen::Vector3d::UnitY();
  double hand_m = 0;  // how far the hand goes that pushes
  Done<PlacedObject> done;
};
struct AddSceneModel {
  std::string id, name, bytes;
  Done<std::shared_ptr<const SceneModel>> done;
};
struct RegisterSceneObject {
  std::string id;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> object_and_world;  // [m]
  bool with_scale = false, accept = false;
  Done<RegisteredObject> done;
};
using SceneCommand = std::variant<PutSceneObject, RemoveSceneObject, PlaceSceneObject,
                                  AddSceneModel, RegisterSceneObject>;

}  // namespace saccade
