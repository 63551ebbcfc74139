#include "tests/integration/stream/patch_room.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>
#include <thread>

namespace saccade::testing {
namespace {

constexpr int kPatch_px = 40;
constexpr double kPatchDepth_m = 2.5;  // where a patch is drawn as it is
constexpr std::chrono::milliseconds kEvery(100);

std::shared_ptr<const CameraModel> Lens() {
  CameraIntrinsics intrinsics;
  intrinsics.width = 640;
  intrinsics.height = 480;
  intrinsics.fx = intrinsics.fy = 480;
  intrinsics.cx = 319.5;
  intrinsics.cy = 239.5;
  intrinsics.fps = 10;
  return std::make_shared<const CameraModel>(intrinsics);
}

class PatchSource final : public FrameSource {
 public:
  PatchSource(std::shared_ptr<const PatchRoom> room, PatchWalk walk)
      : room_(std::move(room)), walk_(walk) {
    info_.uri = "test:patches";
    info_.camera = Lens();
  }
  const SourceInfo& info() const override { return info_; }
  std::uint64_t bad_frames() const override { return 0; }
  absl::StatusOr<std::optional<Frame>> Next() override {
    std::this_thread::sleep_until(start_ + next_ * kEvery);
    Frame frame;
    frame.id = next_++;
    frame.capture_time_ns = frame.received_time_ns = MonotonicNow();
    frame.camera = info_.camera;
    frame.grey = room_->Draw(walk_.At(frame.capture_time_ns), *info_.camera);
    return frame;
  }

 private:
  const std::shared_ptr<const PatchRoom> room_;
  const PatchWalk walk_;
  SourceInfo info_;
  std::uint64_t next_ = 0;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

class PatchTracker final : public FrameTracker {
 public:
  PatchTracker(std::shared_ptr<const PatchRoom> room, PatchWalk walk, Rigid3 map_from_room)
      : room_(std::move(room)), walk_(walk), map_from_room_(std::move(map_from_room)) {}

  std::shared_ptr<const MapSnapshot> Track(const Frame& frame) override {
    auto snapshot = std::make_shared<MapSnapshot>();
    snapshot->frame_id = frame.id;
    snapshot->capture_time_ns = frame.capture_time_ns;
    snapshot->status = TrackingStatus::kTracking;
    snapshot->quality = TrackingQuality::kGood;
    snapshot->metric = true;
    const Rigid3 room_from_camera = walk_.At(frame.capture_time_ns);
    snapshot->world_from_camera = map_from_room_ * room_from_camera;
    snapshot->map_generation = generation_;
    const auto& points = room_->points();
    for (std::size_t k = 0; k < points.size(); k += 3) {
      FeatureSnapshot feature;
      feature.id = k + 1;
      feature.point_in_world = map_from_room_ * points[k];
      feature.covariance_in_world = feature.covariance_in_camera =
          1e-6 * Eigen::Matrix3d::Identity();
      feature.depth_known = true;
      feature.matched_count = 50;
      const auto pixel = frame.camera->Project(room_from_camera.Inverse() * points[k]);
      if (pixel && frame.camera->InImage(*pixel, 20.0)) {
        feature.pixel = pixel;
        feature.state = FeatureState::kMeasured;
        ++snapshot->matched;
      }
      snapshot->features.push_back(feature);
    }
    snapshot->attempted = snapshot->matched;
    return snapshot;
  }
  void Reset() override { ++generation_; }
  absl::StatusOr<FeatureId> SeedFeature(const Frame&, const Rigid3&, const Eigen::Vector2d&, double,
                                        double) override {
    return absl::NotFoundError("scripted: no new features");
  }

 private:
  const std::shared_ptr<const PatchRoom> room_;
  const PatchWalk walk_;
  const Rigid3 map_from_room_;
  std::uint64_t generation_ = 0;
};

}  // namespace

PatchRoom::PatchRoom(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int k = 0; k < 240; ++k) {
    const double x = unit(random), y = unit(random), z = unit(random);
    points_.push_back({2.4 * x, 1.5 * y, 2.6 + 0.8 * z});
  }
  std::sort(points_.begin(), points_.end(),
            [](const auto& a, const auto& b) { return a.z() > b.z(); });
  cv::RNG noise(seed);
  for (std::size_t k = 0; k < points_.size(); ++k) {
    cv::Mat patch(kPatch_px / 4, kPatch_px / 4, CV_8UC1);
    noise.fill(patch, cv::RNG::UNIFORM, 10, 245);
    cv::resize(patch, patch, cv::Size(kPatch_px, kPatch_px), 0, 0, cv::INTER_CUBIC);
    patches_.push_back(patch);
  }
}

cv::Mat PatchRoom::Draw(const Rigid3& room_from_camera, const CameraModel& camera) const {
  cv::Mat picture(camera.height(), camera.width(), CV_8UC1, cv::Scalar(120));
  const Rigid3 camera_from_room = room_from_camera.Inverse();
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const Eigen::Vector3d there = camera_from_room * points_[k];
    const auto pixel = camera.Project(there);
    if (!pixel || there.z() < 0.5) continue;
    const double scale = kPatchDepth_m / there.z();
    // Sub-pixel: the patch's centre falls on the pixel.
    const cv::Mat warp =
        (cv::Mat_<double>(2, 3) << scale, 0, pixel->x() - scale * 0.5 * (kPatch_px - 1), 0, scale,
         pixel->y() - scale * 0.5 * (kPatch_px - 1));
    const int half = static_cast<int>(0.5 * scale * kPatch_px) + 1;
    const cv::Rect whole(0, 0, picture.cols, picture.rows);
    const cv::Rect box = cv::Rect(static_cast<int>(pixel->x()) - half,
                                  static_cast<int>(pixel->y()) - half, 2 * half, 2 * half) &
                         whole;
    if (box.empty()) continue;
    cv::Mat shifted = warp.clone();
    shifted.at<double>(0, 2) -= box.x;
    shifted.at<double>(1, 2) -= box.y;
    cv::Mat target = picture(box);
    cv::warpAffine(patches_[k], target, shifted, box.size(), cv::INTER_LINEAR,
                   cv::BORDER_TRANSPARENT);
  }
  return picture;
}

Rigid3 PatchWalk::At(Timestamp time_ns) const {
  const double t = Seconds(time_ns % 1'000'000'000'000) + phase;
  Rigid3 room_from_camera;
  room_from_camera.translation = {aside_m + 0.35 * std::sin(0.8 * t), 0.12 * std::sin(1.3 * t),
                                  0.1 * std::sin(0.5 * t)};
  room_from_camera.rotation =
      ExpQuaternion({0.05 * std::sin(0.9 * t), 0.22 * std::sin(0.6 * t), 0.04 * std::sin(1.1 * t)});
  return room_from_camera;
}

std::unique_ptr<FrameSource> MakePatchSource(std::shared_ptr<const PatchRoom> room,
                                             PatchWalk walk) {
  return std::make_unique<PatchSource>(std::move(room), walk);
}
std::unique_ptr<FrameTracker> MakePatchTracker(std::shared_ptr<const PatchRoom> room,
                                               PatchWalk walk, Rigid3 map_from_room) {
  return std::make_unique<PatchTracker>(std::move(room), walk, std::move(map_from_room));
}

}  // namespace saccade::testing
