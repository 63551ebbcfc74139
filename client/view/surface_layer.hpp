#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <cstdint>
#include <map>
#include <memory>

#include "client/session/surface_book.hpp"
#include "shared/render/gl_functions.hpp"
#include "shared/render/mesh.hpp"
#include "shared/render/program.hpp"

namespace saccade::view {

/// What of the place the map shows.
enum class MapShows { kBoth, kSurfaces, kDots };
inline MapShows NextOf(MapShows shows) {
  return shows == MapShows::kBoth       ? MapShows::kSurfaces
         : shows == MapShows::kSurfaces ? MapShows::kDots
                                        : MapShows::kBoth;
}

/// The place's surfaces in the map, in their own colours, lit a little from the eye so that shapes
/// are seen. From behind they are darker. Lives on the thread of its OpenGL context, which must be
/// current.
class SurfaceLayer {
 public:
  static absl::StatusOr<std::unique_ptr<SurfaceLayer>> Create(const GlFunctions& gl);

  /// Takes over what changed.
  void Update(const session::SurfaceBook& book);
  /// Into the framebuffer that is bound; depths are tested and written.
  void Draw(const Eigen::Matrix4f& clip_from_world, const Eigen::Vector3d& eye_in_world) const;
  /// Of all chunks.
  std::size_t triangles() const { return triangles_; }

 private:
  struct Uploaded {
    std::shared_ptr<const SurfaceChunk> chunk;
    std::unique_ptr<Mesh> mesh;
    Eigen::Vector3f low, high;  // of its corners
  };

  explicit SurfaceLayer(const GlFunctions& gl) : gl_(gl) {}
  void Upload(const std::shared_ptr<const SurfaceChunk>& chunk, Uploaded& uploaded) const;

  const GlFunctions& gl_;
  std::unique_ptr<Program> program_;
  std::map<SurfaceChunk::Index, Uploaded> chunks_;
  std::uint64_t changes_ = 0;
  std::size_t triangles_ = 0;
};

}  // namespace saccade::view
