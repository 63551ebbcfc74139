#pragma once

#include <absl/status/statusor.h>
#include <imgui.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/session/state.hpp"
#include "client/tools/view.hpp"
#include "client/view/painter.hpp"
#include "shared/render/gl_functions.hpp"
#include "shared/render/mesh.hpp"
#include "shared/render/scene_picture.hpp"
#include "shared/render/texture.hpp"

namespace saccade::view {

/// Things of the scene: over the video through its lens, hidden by what is real, and in the map.
/// Lives on the thread of its OpenGL context, which must be current.
class ThingLayer {
 public:
  static absl::StatusOr<std::unique_ptr<ThingLayer>> Create(const GlFunctions& gl);

  /// Takes over what changed. `markers`: where those are that things are fixed to, in the picture
  /// that is shown.
  void Update(const session::State& state, std::span<const MarkerPose> markers);

  /// Adds what is seen from `view` to `list`, whose picture's pixel (0, 0) has its corner at
  /// `left`, `top`. Draws off screen at once; the window's framebuffer is bound again after.
  void DrawVideo(const tools::View& view, float left, float top, float scale, ImDrawList* list);
  /// Draws into the map's viewport, over what is there: one looks into rooms from outside, so
  /// rooms and planes hide nothing there.
  void DrawMap(const Eigen::Matrix4f& clip_from_camera, const Rigid3& world_from_eye);
  /// Edges of what is real, two points each (GL_LINES): position, colour.
  const Mesh& edges() const { return edges_; }
  /// Why nothing is drawn over the video; empty: it is.
  const std::string& problem() const { return problem_; }

 private:
  explicit ThingLayer(const GlFunctions& gl);
  void Upload(const Scene& scene);
  absl::Status DrawOffScreen(const tools::View& view);
  static void BlendPremultiplied(const ImDrawList* list, const ImDrawCmd* command);

  const GlFunctions& gl_;
  std::unique_ptr<ScenePainter> video_, map_;
  Mesh edges_;
  std::uint64_t version_ = 0;
  std::vector<std::optional<Rigid3>> places_;  // of the objects; nothing: nobody knows
  std::shared_ptr<const CameraModel> lens_;
  std::unique_ptr<ScenePicture> picture_;
  std::unique_ptr<Texture> texture_;
  std::string problem_;
};

}  // namespace saccade::view
