#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <memory>
#include <vector>

#include "client/session/state.hpp"
#include "client/tools/view.hpp"
#include "client/view/surface_layer.hpp"
#include "client/view/thing_layer.hpp"
#include "shared/render/gl_functions.hpp"
#include "shared/render/mesh.hpp"
#include "shared/render/program.hpp"
#include "shared/render/texture.hpp"

namespace saccade::view {

/// The 3D map without marks: the place's surfaces, features in their colours with a line one sigma
/// either way along their worst axis, the wearer's camera with its live picture, its path, a ground
/// grid. Lives on the thread of its OpenGL context, which must be current.
class MapScene {
 public:
  static absl::StatusOr<std::unique_ptr<MapScene>> Create(const GlFunctions& gl);

  /// Takes over what changed in the map and the path.
  void Update(const session::State& state);
  /// The picture and where it was taken from; null: none, or its place is not known.
  void Show(const net::FrameFacts* facts, const Texture* picture);

  /// Draws into `viewport` (x, y from the bottom, width, height [framebuffer px]), clears it first.
  /// `eye`: a pinhole's; `frustum_m`: how far the picture lies before the camera. `things` come
  /// last: known surfaces hide nothing of the map. Where there are no surfaces dots are drawn.
  void Draw(const tools::View& eye, const Eigen::Vector4i& viewport, double frustum_m,
            float point_px, MapShows shows, ThingLayer& things);

 private:
  explicit MapScene(const GlFunctions& gl);
  void BuildGrid();
  void BuildFrustum(const CameraModel& camera);
  void DrawFrustum(const Eigen::Matrix4f& clip_from_world, double frustum_m);

  const GlFunctions& gl_;
  std::unique_ptr<Program> plain_, textured_;
  std::unique_ptr<SurfaceLayer> surfaces_;
  Mesh grid_, points_, sigmas_, path_, frustum_lines_, frustum_picture_;
  const Texture* picture_ = nullptr;
  std::shared_ptr<const CameraModel> camera_;
  Rigid3 world_from_camera_;
  std::uint64_t map_version_ = ~0ULL, path_version_ = ~0ULL;
};

/// Clip coordinates from points in the camera frame of a pinhole without distortion.
Eigen::Matrix4f ClipFromCamera(const CameraModel& camera, double near_m, double far_m);
Eigen::Matrix4f MatrixOf(const Rigid3& target_from_source);

}  // namespace saccade::view
