#include "shared/render/scene_picture.hpp"

#include <cmath>

namespace saccade {
namespace {

constexpr double kBorder_px = 2;        // beyond the last one needed
constexpr double kLeastForward = 0.05;  // of a bearing: beyond, a pinhole shows nothing

}  // namespace

absl::StatusOr<std::unique_ptr<ScenePicture>> ScenePicture::Create(const GlFunctions& gl,
                                                                   const CameraModel& camera,
                                                                   double supersampling) {
  std::unique_ptr<ScenePicture> made(new ScenePicture(gl));
  made->camera_ = camera;
  Eigen::Array2d low = Eigen::Array2d::Zero(), high = Eigen::Array2d::Zero();
  const auto cover = [&](int u, int v) {
    const std::optional<Eigen::Vector3d> ray = camera.Unproject({u, v});
    if (!ray || ray->z() < kLeastForward) return;
    const Eigen::Array2d at = ray->hnormalized().array();
    low = low.min(at);
    high = high.max(at);
  };
  for (int u = 0; u < camera.width(); ++u) cover(u, 0), cover(u, camera.height() - 1);
  for (int v = 0; v < camera.height(); ++v) cover(0, v), cover(camera.width() - 1, v);
  made->fx_ = supersampling * camera.intrinsics().fx;
  made->fy_ = supersampling * camera.intrinsics().fy;
  made->cx_ = kBorder_px - low.x() * made->fx_;
  made->cy_ = kBorder_px - low.y() * made->fy_;
  const int width = static_cast<int>(std::ceil(made->cx_ + high.x() * made->fx_ + kBorder_px)) + 1;
  const int height = static_cast<int>(std::ceil(made->cy_ + high.y() * made->fy_ + kBorder_px)) + 1;
  auto target = Framebuffer::Create(gl, width, height);
  if (!target.ok()) return target.status();
  made->target_ = *std::move(target);
  made->pixels_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
  return made;
}

absl::StatusOr<std::span<const std::uint8_t>> ScenePicture::Draw(ScenePainter& painter,
                                                                 const Rigid3& world_from_camera) {
  target_->Bind();
  gl_.Disable(GL_SCISSOR_TEST);
  gl_.ClearColor(0, 0, 0, 0);
  gl_.Clear(GL_COLOR_BUFFER_BIT);
  // Image v grows along window y, so that the first row read back is the top one.
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip(0, 0) = 2 * fx_ / width();
  clip(0, 2) = 2 * (cx_ + 0.5) / width() - 1;
  clip(1, 1) = 2 * fy_ / height();
  clip(1, 2) = 2 * (cy_ + 0.5) / height() - 1;
  clip(2, 2) = (kFar_m + kNear_m) / (kFar_m - kNear_m);
  clip(2, 3) = -2 * kFar_m * kNear_m / (kFar_m - kNear_m);
  clip(3, 2) = 1;
  painter.Draw(clip.cast<float>(), world_from_camera);
  if (absl::Status read = target_->ReadBgra(pixels_); !read.ok()) return read;
  return std::span<const std::uint8_t>(pixels_);
}

std::optional<Eigen::Vector2d> ScenePicture::ShareOf(const Eigen::Vector2d& pixel) const {
  const std::optional<Eigen::Vector3d> ray = camera_.Unproject(pixel);
  if (!ray || ray->z() < kLeastForward) return std::nullopt;
  const Eigen::Vector2d at = ray->hnormalized();
  return Eigen::Vector2d((fx_ * at.x() + cx_ + 0.5) / width(),
                         (fy_ * at.y() + cy_ + 0.5) / height());
}

}  // namespace saccade
