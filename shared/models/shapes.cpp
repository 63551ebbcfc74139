#include "shared/models/shapes.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <map>

namespace saccade {
namespace {

constexpr double kLeastSize_m = 1e-3, kMostSize_m = 1e3;
constexpr double kLeastScale = 1e-4, kMostScale = 1e4;
constexpr std::size_t kMostName = 100;

void AddQuad(const std::array<std::uint32_t, 4>& corners, std::uint32_t color, TriangleMesh& mesh) {
  mesh.triangles.push_back({corners[0], corners[1], corners[2]});
  mesh.triangles.push_back({corners[0], corners[2], corners[3]});
  mesh.colors_rgba.insert(mesh.colors_rgba.end(), 2, color);
}

TriangleMesh SixFaces(const Eigen::Vector3d& size_m, std::uint32_t color, bool inside) {
  TriangleMesh mesh;
  const Eigen::Vector3f half = (0.5 * size_m).cast<float>();
  for (int corner = 0; corner < 8; ++corner) {
    mesh.positions.emplace_back(corner & 1 ? half.x() : -half.x(),
                                corner & 2 ? -2.0f * half.y() : 0.0f,
                                corner & 4 ? half.z() : -half.z());
  }
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kFaces = {
      {{0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (std::array<std::uint32_t, 4> face : kFaces) {
    if (!inside) std::swap(face[1], face[3]);
    AddQuad(face, color, mesh);
  }
  return mesh;
}

absl::Status CheckSize(const char* axis, double size_m) {
  if (size_m >= kLeastSize_m && size_m <= kMostSize_m) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("size_m.", axis, ": ", size_m, "; give ",
                                                 kLeastSize_m, " to ", kMostSize_m, " metres"));
}

absl::Status CheckParent(const SceneObject& object) {
  if (object.parent == SceneParent::kMarker && object.marker_family.empty()) {
    return absl::InvalidArgumentError("marker.family: is empty; name the marker's family");
  }
  const double side_m = object.marker_side_m;
  if (object.parent == SceneParent::kMarker && !(side_m >= 0.005 && side_m <= 5.0)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "marker.side_m: ", side_m, "; give the side of the marker's black border, 0.005 to 5 m"));
  }
  if (object.parent == SceneParent::kAnchor && object.annotation_id.empty()) {
    return absl::InvalidArgumentError("annotation_id: is empty; name the annotation to move with");
  }
  return absl::OkStatus();
}

}  // namespace

TriangleMesh BoxMesh(const Eigen::Vector3d& size_m, std::uint32_t color_rgba) {
  return SixFaces(size_m, color_rgba, false);
}

TriangleMesh RoomMesh(const Eigen::Vector3d& size_m, std::uint32_t color_rgba) {
  return SixFaces(size_m, color_rgba, true);
}

TriangleMesh PlaneMesh(double size_x_m, double size_z_m, std::uint32_t color_rgba) {
  TriangleMesh mesh;
  const float x = static_cast<float>(0.5 * size_x_m), z = static_cast<float>(0.5 * size_z_m);
  mesh.positions = {{-x, 0, -z}, {x, 0, -z}, {x, 0, z}, {-x, 0, z}};
  AddQuad({0, 1, 2, 3}, color_rgba, mesh);
  return mesh;
}

void Append(const TriangleMesh& mesh, const Rigid3& to_from_mesh, double scale, TriangleMesh& to) {
  const auto base = static_cast<std::uint32_t>(to.positions.size());
  to.positions.reserve(to.positions.size() + mesh.positions.size());
  for (const Eigen::Vector3f& p : mesh.positions) {
    to.positions.emplace_back((to_from_mesh * (scale * p.cast<double>())).cast<float>());
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const TriangleMesh::Triangle& t = mesh.triangles[i];
    to.triangles.push_back({base + t[0], base + t[1], base + t[2]});
    to.colors_rgba.push_back(mesh.colors_rgba.empty() ? 0xb4b4b4ff : mesh.colors_rgba[i]);
  }
}

TriangleMesh MeshOf(const SceneObject& object, const SceneModel* model) {
  switch (object.shape) {
    case SceneShape::kPlane:
      return PlaneMesh(object.size_m.x(), object.size_m.z(), object.color_rgba);
    case SceneShape::kBox:
      return BoxMesh(object.size_m, object.color_rgba);
    case SceneShape::kRoom:
      return RoomMesh(object.size_m, object.color_rgba);
    case SceneShape::kModel:
      break;
  }
  TriangleMesh mesh;
  if (model != nullptr) Append(model->mesh, Rigid3(), object.scale, mesh);
  return mesh;
}

bool IsClosed(const TriangleMesh& mesh) {
  // Corners at one place are one corner: files split them where colours or normals change.
  std::map<std::array<float, 3>, std::uint32_t> places;
  std::vector<std::uint32_t> place(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Eigen::Vector3f p = mesh.positions[i] + Eigen::Vector3f::Zero();  // no -0
    place[i] =
        places.emplace(std::array{p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(places.size()))
            .first->second;
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const TriangleMesh::Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = place[t[k]], b = place[t[(k + 1) % 3]];
      if (a != b) edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, balance] : edges) {
    if (balance != 0) return false;
  }
  return !edges.empty();
}

absl::Status Validate(const SceneObject& object) {
  if (object.name.empty() || object.name.size() > kMostName) {
    return absl::InvalidArgumentError(
        absl::StrCat("name: ", object.name.size(), " bytes; give 1 to ", kMostName));
  }
  if (object.shape == SceneShape::kModel) {
    if (object.model.empty()) {
      return absl::InvalidArgumentError("model: is empty; name a model that was added");
    }
    if (!(object.scale >= kLeastScale && object.scale <= kMostScale)) {
      return absl::InvalidArgumentError(
          absl::StrCat("scale: ", object.scale, "; give ", kLeastScale, " to ", kMostScale));
    }
  } else {
    absl::Status size = CheckSize("x", object.size_m.x());
    if (size.ok()) size = CheckSize("z", object.size_m.z());
    if (size.ok() && object.shape != SceneShape::kPlane) size = CheckSize("y", object.size_m.y());
    if (!size.ok()) return size;
  }
  const Rigid3& pose = object.parent_from_object;
  if (!pose.translation.allFinite() || !(pose.translation.norm() <= 1e5)) {
    return absl::InvalidArgumentError("pose.position: not finite, or beyond 100 km");
  }
  if (!(std::abs(pose.rotation.norm() - 1.0) <= 1e-3)) {
    return absl::InvalidArgumentError("pose.rotation: no unit quaternion (x, y, z, w)");
  }
  return CheckParent(object);
}

}  // namespace saccade
