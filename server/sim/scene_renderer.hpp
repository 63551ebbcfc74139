#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "server/gl/gl_context.hpp"
#include "server/sim/surface.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/render/framebuffer.hpp"
#include "shared/render/mesh.hpp"
#include "shared/render/program.hpp"
#include "shared/render/texture.hpp"

namespace saccade {

/// A camera without distortion; pixel (0, 0) is the centre of the top-left pixel.
struct PinholeView {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  // [px]
};

/// Draws a RoomScene with OpenGL into main memory. Lives on the thread that created it.
class SceneRenderer {
 public:
  static constexpr double kNear_m = 0.05, kFar_m = 12.0;

  /// Makes a context of its own. Errors of the context pass through.
  static absl::StatusOr<std::unique_ptr<SceneRenderer>> Create(const RoomScene& scene,
                                                               const PinholeView& view,
                                                               GlBackend backend);

  /// The picture from `world_from_camera`: CV_8UC4, B G R A, view.height x view.width.
  absl::Status Draw(const Rigid3& world_from_camera, cv::Mat& bgra);
  /// Depth along the optic axis [m] of the picture drawn last, CV_32FC1.
  absl::Status ReadDepth(cv::Mat& depth_m);

  const PinholeView& view() const { return view_; }

 private:
  struct DrawCall {
    int texture = 0;
    std::size_t first = 0, count = 0;  // indices
  };

  explicit SceneRenderer(const PinholeView& view) : view_(view) {}
  absl::Status Upload(const RoomScene& scene);
  Eigen::Matrix4f ClipFromWorld(const Rigid3& world_from_camera) const;

  PinholeView view_;
  std::unique_ptr<GlContext> context_;  // first member made, last destroyed
  GlFunctions gl_;
  std::unique_ptr<Framebuffer> target_;
  std::unique_ptr<Program> program_;
  std::unique_ptr<Mesh> mesh_;
  std::vector<std::unique_ptr<Texture>> textures_;
  std::unique_ptr<Texture> light_;
  std::vector<DrawCall> calls_;
};

}  // namespace saccade
