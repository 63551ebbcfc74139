#include "server/sim/sim_camera.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kMaxSubExposures = 8;
constexpr double kStep_px = 1.4;         // between sub-exposures; the lens softens as much
constexpr double kNearestThing_m = 0.6;  // for the blur that translation causes

}  // namespace

SimCamera::SimCamera(const CameraModel& camera, const SimOptions& options, const Wearer& wearer)
    : camera_(camera),
      options_(options),
      wearer_(wearer),
      lens_(camera, options.supersampling),
      sensor_(options) {}

absl::StatusOr<std::unique_ptr<SimCamera>> SimCamera::Create(const RoomScene& scene,
                                                             const CameraModel& camera,
                                                             const SimOptions& options,
                                                             const Wearer& wearer,
                                                             GlBackend backend) {
  auto made = std::unique_ptr<SimCamera>(new SimCamera(camera, options, wearer));
  absl::StatusOr<std::unique_ptr<SceneRenderer>> renderer =
      SceneRenderer::Create(scene, made->lens_.view(), backend);
  if (!renderer.ok()) return renderer.status();
  made->renderer_ = *std::move(renderer);
  return made;
}

Rigid3 HeadPath::At(double share) const {
  if (shoulder_from_camera.empty()) return {};
  const double at =
      std::clamp(share, 0.0, 1.0) * static_cast<double>(shoulder_from_camera.size() - 1);
  const auto before = static_cast<std::size_t>(at);
  const std::size_t after = std::min(before + 1, shoulder_from_camera.size() - 1);
  const double part = at - static_cast<double>(before);
  const Rigid3 &a = shoulder_from_camera[before], &b = shoulder_from_camera[after];
  return {a.rotation.slerp(part, b.rotation), (1 - part) * a.translation + part * b.translation};
}

int SimCamera::SubExposures(double time_s, const HeadPath& head) const {
  if (!options_.blur || options_.exposure_s <= 0) return 1;
  const double half = 0.5 * options_.exposure_s;
  const Rigid3 before = wearer_.WorldFromShoulder(std::max(0.0, time_s - half)) * head.At(0);
  const Rigid3 after = wearer_.WorldFromShoulder(time_s + half) * head.At(1);
  const double moved_rad = RotationAngle(before, after) +
                           (after.translation - before.translation).norm() / kNearestThing_m;
  const double moved_px = moved_rad / camera_.RadiansPerPixel();
  return std::clamp(static_cast<int>(std::ceil(moved_px / kStep_px)), 1, kMaxSubExposures);
}

absl::StatusOr<cv::Mat> SimCamera::Take(std::uint64_t frame, const HeadPath& head,
                                        bool with_noise) {
  const double time_s = static_cast<double>(frame) / options_.fps;
  const int count = SubExposures(time_s, head);
  for (int k = 0; k < count; ++k) {
    const double offset = (k + 0.5) / count - 0.5;
    const Rigid3 pose =
        wearer_.WorldFromShoulder(std::max(0.0, time_s + offset * options_.exposure_s)) *
        head.At(0.5 + offset);
    if (const absl::Status drawn = renderer_->Draw(pose, drawn_); !drawn.ok()) return drawn;
    if (count == 1) break;
    if (k == 0) {
      drawn_.convertTo(sum_, CV_16U);
    } else {
      cv::add(sum_, drawn_, sum_, cv::noArray(), CV_16U);
    }
  }
  if (count > 1) sum_.convertTo(drawn_, CV_8U, 1.0 / count);
  cv::Mat picture;
  lens_.Apply(drawn_, picture);
  sensor_.Apply(frame, with_noise && options_.noise > 0, picture);
  return picture;
}

absl::StatusOr<cv::Mat> SimCamera::Depth(double time_s, const HeadPath& head) {
  const Rigid3 pose = wearer_.WorldFromShoulder(time_s) * head.At(0.5);
  if (const absl::Status drawn = renderer_->Draw(pose, drawn_); !drawn.ok()) return drawn;
  cv::Mat depth;
  if (const absl::Status read = renderer_->ReadDepth(depth); !read.ok()) return read;
  cv::Mat result(camera_.height(), camera_.width(), CV_32FC1);
  for (int v = 0; v < result.rows; ++v) {
    for (int u = 0; u < result.cols; ++u) {
      const Eigen::Vector2d at = lens_.DrawnFromCamera(camera_, Eigen::Vector2d(u, v));
      result.at<float>(v, u) = depth.at<float>(static_cast<int>(std::lround(at.y())),
                                               static_cast<int>(std::lround(at.x())));
    }
  }
  return result;
}

}  // namespace saccade
