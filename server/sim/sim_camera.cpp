#include "server/sim/sim_camera.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kMaxSubExposures = 8;
constexpr double kStep_px = 1.4;         // between sub-exposures; the lens softens as much
constexpr int kMaxRowExposures = 16;     // with a shutter that rolls
constexpr double kNearestThing_m = 0.6;  // for the blur that translation causes
// Gain and white balance that follow the scene.
constexpr double kLightStep_s = 0.2;    // between two looks at the light
constexpr int kLightSteps = 4;          // that count
constexpr double kWellExposed = 118.0;  // mean level that the gain aims at
constexpr double kGainFollows = 0.5;    // exponents: 1 would keep the mean as it is
constexpr double kBalanceFollows = 0.5;

cv::Mat RowOf(const cv::Mat& picture, int v) {
  cv::Mat row;
  picture.row(v).convertTo(row, CV_32F);
  return row;
}

}  // namespace

SimCamera::SimCamera(const CameraModel& camera, const SimOptions& options, const Wearer& wearer)
    : camera_(camera),
      options_(options),
      wearer_(wearer),
      lens_(camera, options.supersampling),
      sensor_(options),
      effects_(options) {}

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

int SimCamera::SubExposures(double time_s, const HeadPath& head, double span_s, int most) const {
  if (span_s <= 0) return 1;
  const double half = 0.5 * span_s;
  const Rigid3 before = wearer_.WorldFromShoulder(std::max(0.0, time_s - half)) * head.At(0);
  const Rigid3 after = wearer_.WorldFromShoulder(time_s + half) * head.At(1);
  const double moved_rad = RotationAngle(before, after) +
                           (after.translation - before.translation).norm() / kNearestThing_m;
  const double moved_px = moved_rad / camera_.RadiansPerPixel();
  return std::clamp(static_cast<int>(std::ceil(moved_px / kStep_px)), 1, most);
}

absl::Status SimCamera::Expose(double time_s, const HeadPath& head, cv::Mat& picture) {
  const int count =
      SubExposures(time_s, head, options_.blur ? options_.exposure_s : 0.0, kMaxSubExposures);
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
  lens_.Apply(drawn_, picture);
  return absl::OkStatus();
}

absl::Status SimCamera::ExposeRows(double time_s, const HeadPath& head, cv::Mat& picture) {
  const double exposure_s = options_.blur ? options_.exposure_s : 0.0;
  const double span_s = exposure_s + options_.rolling_shutter_s;
  const int count = std::max(2, SubExposures(time_s, head, span_s, kMaxRowExposures));
  const double step_s = span_s / count;
  const int height = camera_.height();
  cv::Mat sum, weights = cv::Mat::zeros(height, 1, CV_32F), bent;
  for (int k = 0; k < count; ++k) {
    const double offset_s = (k + 0.5) * step_s - 0.5 * span_s;
    // The head's path is known over the exposure of the middle row; beyond, it keeps its place.
    const double share = exposure_s > 0 ? 0.5 + offset_s / exposure_s : 0.5;
    const Rigid3 pose =
        wearer_.WorldFromShoulder(std::max(0.0, time_s + offset_s)) * head.At(share);
    if (const absl::Status drawn = renderer_->Draw(pose, drawn_); !drawn.ok()) return drawn;
    lens_.Apply(drawn_, bent);
    if (k == 0) sum = cv::Mat::zeros(bent.size(), CV_32FC3);
    for (int v = 0; v < height; ++v) {
      // How much of this moment falls into the row's exposure; at least the nearest counts.
      const double row_s = options_.rolling_shutter_s * ((v + 0.5) / height - 0.5);
      const double half_s = 0.5 * std::max(exposure_s, step_s);
      const double from = std::max(offset_s - 0.5 * step_s, row_s - half_s);
      const double until = std::min(offset_s + 0.5 * step_s, row_s + half_s);
      const auto weight = static_cast<float>(std::max(0.0, until - from) / step_s);
      if (weight <= 0.0F) continue;
      weights.at<float>(v) += weight;
      cv::Mat row = sum.row(v);
      cv::scaleAdd(RowOf(bent, v), weight, row, row);
    }
  }
  for (int v = 0; v < height; ++v) sum.row(v) *= 1.0 / weights.at<float>(v);
  sum.convertTo(picture, CV_8U);
  return absl::OkStatus();
}

absl::StatusOr<cv::Vec3d> SimCamera::LightAt(std::int64_t step, const HeadPath& head) {
  const auto known = lights_.find(step);
  if (known != lights_.end()) return known->second;
  const Rigid3 pose = wearer_.WorldFromShoulder(
                          kLightStep_s * static_cast<double>(std::max<std::int64_t>(0, step))) *
                      head.At(0.5);
  if (const absl::Status drawn = renderer_->Draw(pose, drawn_); !drawn.ok()) return drawn;
  const cv::Scalar mean = cv::mean(drawn_);
  const cv::Vec3d light(mean[0], mean[1], mean[2]);
  if (!head.shoulder_from_camera.empty()) return light;  // a driven head's way is not known here
  while (lights_.size() > 64) lights_.erase(lights_.begin());
  return lights_[step] = light;
}

absl::StatusOr<cv::Vec3d> SimCamera::SceneGain(double time_s, const HeadPath& head) {
  // A camera meters with some delay: the weights fall over the second before.
  const auto newest = static_cast<std::int64_t>(std::floor(time_s / kLightStep_s));
  const double part = time_s / kLightStep_s - static_cast<double>(newest);
  cv::Vec3d light(0, 0, 0);
  double total = 0.0;
  for (int k = 0; k <= kLightSteps; ++k) {
    // Linear between steps, so that gain does not jump at one.
    const double weight = std::max(0.0, 1.0 - (k + part) / kLightSteps) + 1e-9;
    const absl::StatusOr<cv::Vec3d> then = LightAt(newest - k, head);
    if (!then.ok()) return then.status();
    light += weight * *then;
    total += weight;
  }
  light /= total;
  const double grey = std::max(8.0, (light[0] + light[1] + light[2]) / 3.0);
  const double gain = std::clamp(std::pow(kWellExposed / grey, kGainFollows), 0.4, 2.5);
  cv::Vec3d gains;
  for (int c = 0; c < 3; ++c) {
    gains[c] = gain * std::pow(grey / std::max(8.0, light[c]), kBalanceFollows);
  }
  return gains;
}

absl::StatusOr<cv::Mat> SimCamera::Take(std::uint64_t frame, const HeadPath& head,
                                        bool with_noise) {
  const double time_s = options_.TimeOf(frame);
  cv::Vec3d gain = cv::Vec3d::all(sensor_.Gain(frame));
  if (options_.auto_exposure == SimExposure::kScene) {
    const absl::StatusOr<cv::Vec3d> found = SceneGain(time_s, head);
    if (!found.ok()) return found.status();
    gain = *found;
  }
  cv::Mat picture;
  const absl::Status exposed = options_.rolling_shutter_s > 0 ? ExposeRows(time_s, head, picture)
                                                              : Expose(time_s, head, picture);
  if (!exposed.ok()) return exposed;
  effects_.DrawArm(time_s, picture);
  effects_.Soften(picture);
  sensor_.Apply(frame, gain, with_noise && options_.noise > 0, picture);
  if (with_noise) {
    if (const absl::Status coded = effects_.Compress(picture); !coded.ok()) return coded;
  }
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
