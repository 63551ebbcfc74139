#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <memory>
#include <span>

#include "shared/geometry/rigid3.hpp"
#include "shared/render/gl_functions.hpp"
#include "shared/render/mesh.hpp"
#include "shared/render/placed_mesh.hpp"
#include "shared/render/program.hpp"
#include "shared/scene/scene_light.hpp"

namespace saccade {

/// A real surface hides what is more than this behind it, along the optic axis [m]: what hangs on a
/// wall is not eaten by it.
inline constexpr double kOcclusionBias_m = 0.005;

/// Draws virtual things behind real ones: first the depth of what is real, kOcclusionBias_m
/// farther, then what is virtual, shaded by the light that is known (else by one at the eye), with
/// soft shadows where it rests; what is hidden comes last, through everything. Lives on the thread
/// of its context, which must be current; `gl` must outlive it.
class ScenePainter {
 public:
  static absl::StatusOr<std::unique_ptr<ScenePainter>> Create(const GlFunctions& gl);

  /// Replaces what is drawn.
  void Upload(std::span<const PlacedMesh> meshes);
  /// From the next Draw() on; of confidence 0: nothing is known.
  void SetLight(const SceneLight& light) { light_ = light; }
  /// Whether anything would be seen.
  bool empty() const { return drawn_.index_count() == 0 && hidden_.index_count() == 0; }

  /// Into the framebuffer that is bound, whose depth it clears twice; colours are premultiplied by
  /// alpha, which is 0 where nothing virtual is. `clip_from_camera`: a pinhole's, whose w is the
  /// depth along the optic axis.
  void Draw(const Eigen::Matrix4f& clip_from_camera, const Rigid3& world_from_camera);

 private:
  explicit ScenePainter(const GlFunctions& gl);

  const GlFunctions& gl_;
  std::unique_ptr<Program> depth_, shaded_, shadow_;
  Mesh real_, drawn_, hidden_, shadows_;
  SceneLight light_;
};

}  // namespace saccade
