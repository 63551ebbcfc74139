#include "server/eval/still_camera.hpp"

#include <opencv2/imgproc.hpp>

#include "server/sim/room.hpp"

namespace saccade {
namespace {

constexpr double kClear_m = 0.35;  // no surface nearer than this on the view's axes
const Eigen::Vector3d kRoom_m(4.0, 2.5, 4.0);

}  // namespace

StillCamera::StillCamera(const SimOptions& options)
    : options_(options),
      scene_(BuildRoom(options.seed)),
      lens_(std::make_shared<const CameraModel>(options.Intrinsics())),
      wearer_(options.motion, options.seed),
      caster_(std::make_unique<RayCaster>(scene_)) {}

absl::StatusOr<StillCamera> StillCamera::Create(std::uint64_t seed) {
  SimOptions options;
  options.seed = seed;
  options.motion = SimMotion::kStill;
  StillCamera still(options);
  auto camera =
      SimCamera::Create(still.scene_, *still.lens_, options, still.wearer_, GlBackend::kOsmesa);
  if (!camera.ok()) return camera.status();
  still.camera_ = *std::move(camera);
  return still;
}

absl::StatusOr<cv::Mat> StillCamera::Take(const Rigid3& world_from_camera, std::uint64_t number) {
  const double time_s = static_cast<double>(number) / options_.fps;
  HeadPath path;
  path.shoulder_from_camera = {wearer_.WorldFromShoulder(time_s).Inverse() * world_from_camera};
  const absl::StatusOr<cv::Mat> picture = camera_->Take(number, path, /*with_noise=*/true);
  if (!picture.ok()) return picture.status();
  cv::Mat grey;
  cv::cvtColor(*picture, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

bool StillCamera::Clear(const Rigid3& world_from_camera) const {
  const Rigid3 room_from_camera = WorldFromRoom().Inverse() * world_from_camera;
  const Eigen::Vector3d& at = room_from_camera.translation;
  if ((at.array() < kClear_m).any() || (at.array() > kRoom_m.array() - kClear_m).any()) {
    return false;
  }
  for (const Eigen::Vector3d& look : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.6, 0, 0.8),
                                      Eigen::Vector3d(-0.6, 0, 0.8), Eigen::Vector3d(0, 1, 0)}) {
    const Eigen::Vector3d direction = room_from_camera.rotation * look;
    if (caster_->Closest(at.cast<float>(), direction.cast<float>(), static_cast<float>(kClear_m))) {
      return false;
    }
  }
  return true;
}

bool StillCamera::SeesTarget(const Rigid3& world_from_camera) const {
  for (const double x : {-0.04, 0.16, 0.36}) {
    for (const double y : {-0.04, 0.1, 0.24}) {
      const auto pixel = lens_->Project(world_from_camera.Inverse() * Eigen::Vector3d(x, y, 0));
      if (pixel && lens_->InImage(*pixel)) return true;
    }
  }
  return false;
}

}  // namespace saccade
