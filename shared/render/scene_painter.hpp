#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <memory>
#include <span>

#include "shared/geometry/rigid3.hpp"
#include "shared/render/gl_functions.hpp"
#include "shared/render/mesh.hpp"
#include "shared/render/program.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade {

/// A real surface hides what is more than this behind it, along the optic axis [m]: what hangs on a
/// wall is not eaten by it.
inline constexpr double kOcclusionBias_m = 0.005;

/// A mesh of a scene where it is now.
struct PlacedMesh {
  std::shared_ptr<const TriangleMesh> mesh;  // never null
  Rigid3 world_from_mesh;
  SceneMaterial material = SceneMaterial::kReal;
};

/// Draws virtual things behind real ones: first the depth of what is real, kOcclusionBias_m
/// farther, then what is virtual, shaded by a light at the eye; what is hidden comes last, through
/// everything. Lives on the thread of its context, which must be current; `gl` must outlive it.
class ScenePainter {
 public:
  static absl::StatusOr<std::unique_ptr<ScenePainter>> Create(const GlFunctions& gl);

  /// Replaces what is drawn.
  void Upload(std::span<const PlacedMesh> meshes);
  /// Whether anything would be seen.
  bool empty() const { return drawn_.index_count() == 0 && hidden_.index_count() == 0; }

  /// Into the framebuffer that is bound, whose depth it clears twice; colours are premultiplied by
  /// alpha, which is 0 where nothing virtual is. `clip_from_camera`: a pinhole's, whose w is the
  /// depth along the optic axis.
  void Draw(const Eigen::Matrix4f& clip_from_camera, const Rigid3& world_from_camera);

 private:
  explicit ScenePainter(const GlFunctions& gl);

  const GlFunctions& gl_;
  std::unique_ptr<Program> depth_, shaded_;
  Mesh real_, drawn_, hidden_;
};

}  // namespace saccade
