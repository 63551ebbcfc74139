#pragma once

#include <absl/status/status.h>

#include "shared/geometry/rigid3.hpp"
#include "shared/scene/scene_object.hpp"
#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

/// A box that stands on y = 0, `size_m` along x, y and z, its sides seen from outside.
TriangleMesh BoxMesh(const Eigen::Vector3d& size_m, std::uint32_t color_rgba);
/// The same seen from inside: floor at y = 0, walls, ceiling.
TriangleMesh RoomMesh(const Eigen::Vector3d& size_m, std::uint32_t color_rgba);
/// A rectangle in y = 0, seen from above (from -y).
TriangleMesh PlaneMesh(double size_x_m, double size_z_m, std::uint32_t color_rgba);

/// `mesh` appended to `to`, moved.
void Append(const TriangleMesh& mesh, const Rigid3& to_from_mesh, double scale, TriangleMesh& to);

/// The object's triangles in its own frame, `scale` included. `model` is what it names, null for
/// other shapes; a model that is not there gives no triangles.
TriangleMesh MeshOf(const SceneObject& object, const SceneModel* model);

/// Every edge between two triangles that run it in opposite ways: the mesh has an inside.
bool IsClosed(const TriangleMesh& mesh);

/// InvalidArgument names the field and the remedy: name, sizes (1 mm to 1 km), scale (1e-4 to 1e4),
/// pose, parent, model.
absl::Status Validate(const SceneObject& object);

}  // namespace saccade
