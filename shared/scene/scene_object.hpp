#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

enum class SceneShape { kPlane, kBox, kRoom, kModel };

/// What an object does. Real: there in the world; hides, holds and stops virtual things, is not
/// drawn. Virtual: drawn where nothing real is nearer; holds and stops others. Guide: drawn so too,
/// but holds and stops nothing (floor grid, route). Hidden: drawn through what is before it (wires
/// in the wall); holds and stops nothing.
enum class SceneMaterial { kReal, kVirtual, kGuide, kHidden };

/// What an object moves with.
enum class SceneParent { kWorld, kMarker, kAnchor };

/// Known geometry or a virtual thing. Its own frame is that of TriangleMesh with the origin in the
/// middle of its base: a box stands on it, a room's floor lies in it, a plane is it (y = 0, seen
/// from above).
struct SceneObject {
  std::string id;    // UUID
  std::string name;  // 1 to 100 bytes
  SceneShape shape = SceneShape::kBox;
  SceneMaterial material = SceneMaterial::kReal;
  std::string model;                                 // of kModel alone: SceneModel::id
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();  // box, room; plane: x and z; not of kModel
  double scale = 1.0;                                // of kModel alone
  SceneParent parent = SceneParent::kWorld;
  std::string marker_family;    // of kMarker
  std::uint32_t marker_id = 0;  // of kMarker
  double marker_side_m = 0;     // of kMarker: of its black border
  std::string annotation_id;    // of kAnchor: whose place it moves with, its turn does not
  Rigid3 parent_from_object;
  std::uint32_t color_rgba = 0xb4b4b4ff;  // of what is no model
};

/// Triangles to place, kept once however often they are placed. Immutable.
struct SceneModel {
  std::string id;    // SHA-256 of its file, lower-case hex; of a scene file: the path there
  std::string name;  // 1 to 100 bytes
  TriangleMesh mesh;
  std::shared_ptr<const std::string> file;  // GLB; never null
};

/// Everything, at one revision. Immutable once shared.
struct Scene {
  std::uint64_t revision = 0;
  std::vector<SceneObject> objects;
  std::vector<std::shared_ptr<const SceneModel>> models;

  const SceneObject* Find(const std::string& id) const {
    for (const SceneObject& object : objects) {
      if (object.id == id) return &object;
    }
    return nullptr;
  }
  std::shared_ptr<const SceneModel> Model(const std::string& id) const {
    for (const auto& model : models) {
      if (model->id == id) return model;
    }
    return nullptr;
  }
};

}  // namespace saccade
