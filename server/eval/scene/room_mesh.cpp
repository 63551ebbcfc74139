#include "server/eval/scene/room_mesh.hpp"

namespace saccade {

TriangleMesh RoomMeshOf(const RoomScene& room) {
  TriangleMesh mesh;
  for (const SurfacePatch& patch : room.patches) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), patch.positions.begin(), patch.positions.end());
    const auto stride = static_cast<std::uint32_t>(patch.columns + 1);
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(patch.rows); ++j) {
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(patch.columns); ++i) {
        const std::uint32_t a = base + j * stride + i;
        mesh.triangles.push_back({a, a + stride, a + 1});
        mesh.triangles.push_back({a + 1, a + stride, a + stride + 1});
      }
    }
  }
  return mesh;
}

}  // namespace saccade
