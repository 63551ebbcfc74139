#include "server/scene/scene_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/sim/lens.hpp"
#include "server/sim/render_thread.hpp"
#include "shared/render/framebuffer.hpp"

namespace saccade {
namespace {

constexpr double kMostSupersampling = 3.0, kMostDrawnPixels = 4.0 * 1280 * 720;

/// Image v grows along window y, so that the first row read back is the top one.
Eigen::Matrix4f ClipFromCamera(const PinholeView& view) {
  constexpr double kNear = SceneView::kNear_m, kFar = SceneView::kFar_m;
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip(0, 0) = 2.0 * view.fx / view.width;
  clip(0, 2) = 2.0 * (view.cx + 0.5) / view.width - 1.0;
  clip(1, 1) = 2.0 * view.fy / view.height;
  clip(1, 2) = 2.0 * (view.cy + 0.5) / view.height - 1.0;
  clip(2, 2) = (kFar + kNear) / (kFar - kNear);
  clip(2, 3) = -2.0 * kFar * kNear / (kFar - kNear);
  clip(3, 2) = 1.0;
  return clip.cast<float>();
}

}  // namespace

struct SceneView::Impl {
  Impl(const CameraModel& camera, double supersampling) : lens(camera, supersampling) {}

  absl::Status Start(GlBackend backend) {
    absl::StatusOr<std::unique_ptr<GlContext>> made = GlContext::Create(backend);
    if (!made.ok()) return made.status();
    context = *std::move(made);
    absl::StatusOr<GlFunctions> functions =
        GlFunctions::Load([this](const char* name) { return context->GetProcAddress(name); });
    if (!functions.ok()) return functions.status();
    gl = *functions;
    auto framebuffer = Framebuffer::Create(gl, lens.view().width, lens.view().height);
    if (!framebuffer.ok()) return framebuffer.status();
    target = *std::move(framebuffer);
    auto scene_painter = ScenePainter::Create(gl);
    if (!scene_painter.ok()) return scene_painter.status();
    painter = *std::move(scene_painter);
    return absl::OkStatus();
  }
  void End() {
    painter = nullptr;
    target = nullptr;
    context = nullptr;
  }
  absl::StatusOr<cv::Mat> Draw(const Rigid3& world_from_camera) {
    target->Bind();
    gl.ClearColor(0, 0, 0, 0);
    gl.Clear(GL_COLOR_BUFFER_BIT);
    painter->Draw(ClipFromCamera(lens.view()), world_from_camera);
    cv::Mat drawn(lens.view().height, lens.view().width, CV_8UC4);
    const absl::Status read = target->ReadBgra({drawn.data, drawn.total() * 4});
    if (!read.ok()) return read;
    cv::Mat bent;
    lens.Bend(drawn, bent);
    return bent;
  }

  const Lens lens;
  // On the thread alone.
  std::unique_ptr<GlContext> context;
  GlFunctions gl;
  std::unique_ptr<Framebuffer> target;
  std::unique_ptr<ScenePainter> painter;
  RenderThread thread;  // last: it uses all of the above
};

SceneView::SceneView(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

SceneView::~SceneView() {
  impl_->thread.Submit([this] { impl_->End(); }).wait();
}

absl::StatusOr<std::unique_ptr<SceneView>> SceneView::Create(const CameraModel& camera,
                                                             GlBackend backend,
                                                             double supersampling) {
  std::unique_ptr<SceneView> made(new SceneView(std::make_unique<Impl>(camera, supersampling)));
  Impl& impl = *made->impl_;
  const absl::Status started =
      impl.thread.Submit([&impl, backend] { return impl.Start(backend); }).get();
  if (!started.ok()) return started;
  return made;
}

absl::Status SceneView::SetMeshes(std::vector<PlacedMesh> meshes) {
  return impl_->thread
      .Submit([this, meshes = std::move(meshes)] {
        impl_->painter->Upload(meshes);
        return CheckGl(impl_->gl, "upload of the scene");
      })
      .get();
}

void SceneView::SetLight(const SceneLight& light) {
  impl_->thread.Submit([this, light] { impl_->painter->SetLight(light); }).get();
}

absl::StatusOr<cv::Mat> SceneView::Draw(const Rigid3& world_from_camera) {
  return impl_->thread.Submit([this, world_from_camera] { return impl_->Draw(world_from_camera); })
      .get();
}

double EnoughSupersampling(const CameraModel& camera) {
  const double pixels = static_cast<double>(camera.width()) * camera.height();
  return std::clamp(std::sqrt(kMostDrawnPixels / pixels), 1.0, kMostSupersampling);
}

void Blend(const cv::Mat& premultiplied_bgra, cv::Mat& bgr) {
  for (int row = 0; row < bgr.rows; ++row) {
    const auto* over = premultiplied_bgra.ptr<cv::Vec4b>(row);
    auto* under = bgr.ptr<cv::Vec3b>(row);
    for (int column = 0; column < bgr.cols; ++column) {
      const int through = 255 - over[column][3];
      if (through == 255) continue;
      for (int k = 0; k < 3; ++k) {
        const int sum = over[column][k] + (under[column][k] * through + 127) / 255;
        under[column][k] = static_cast<std::uint8_t>(std::min(sum, 255));
      }
    }
  }
}

}  // namespace saccade
