// Digital gaze: the same control steers a crop of a fixed camera's picture.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/gaze/gaze_loop.hpp"
#include "server/mount/drivers/crop_mount.hpp"
#include "tests/support/pinhole.hpp"

namespace saccade::crop_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr Timestamp kMs = 1'000'000;

CameraIntrinsics Camera() { return Pinhole(640, 480, 458); }

/// Steps the loop on MonotonicNow-free time; the wearer, who carries the camera, rolls and sways.
class CropWorld {
 public:
  CropWorld()
      : crop_(*CropMount::Create(Camera(), 320, 240)),
        loop_(*crop_, Options(), [] { return "lease"; }) {}

  static GazeOptions Options() {
    GazeOptions options;
    options.rate_deg_s = 120;
    options.acceleration_deg_s2 = 2000;
    return options;
  }
  static Rigid3 Camera_(double t) {
    Rigid3 pose;
    const double w = std::numbers::pi * t;
    pose.rotation = ExpQuaternion(
        kDegree * Eigen::Vector3d(2 * std::sin(w + 1), 4 * std::sin(w), 10 * std::sin(0.7 * w)));
    pose.translation = 0.02 * Eigen::Vector3d(std::sin(w), std::cos(w), 0);
    return pose;
  }
  void Run(double seconds, const std::function<void(const GazeSnapshot&, double)>& frame) {
    const Timestamp end = now_ + static_cast<Timestamp>(1e9 * seconds);
    while (now_ < end) {
      now_ += 10 * kMs;
      if (now_ % (30 * kMs) == 0) {
        auto map = std::make_shared<MapSnapshot>();
        map->status = TrackingStatus::kTracking;
        map->capture_time_ns = now_ - 30 * kMs;
        map->world_from_camera = Camera_(Seconds(map->capture_time_ns));
        loop_.OnView({map, nullptr, MountAngles{}, Eigen::Vector3d::UnitY()});
        loop_.Step(now_);
        frame(*loop_.snapshot(), Seconds(map->capture_time_ns));
      } else {
        loop_.Step(now_);
      }
    }
  }
  GazeLoop& loop() { return loop_; }

 private:
  std::shared_ptr<CropMount> crop_;
  GazeLoop loop_;
  Timestamp now_ = 1'000'000'000;
};

TEST(Crop, TheTargetStaysInTheMiddleAndThePictureLevel) {
  CropWorld world;
  world.Run(0.5, [](const GazeSnapshot&, double) {});
  const Eigen::Vector3d target(0.15, 0.05, 1.2);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{target}, false).ok());
  world.Run(1.0, [](const GazeSnapshot&, double) {});
  double worst_deg = 0, worst_roll_deg = 0;
  world.Run(10.0, [&](const GazeSnapshot& state, double time_s) {
    ASSERT_TRUE(state.world_from_view);
    // The crop of the frame of `time_s`, as the engine makes it: by the view's orientation in
    // world.
    const Eigen::Vector3d line = target - CropWorld::Camera_(time_s).translation;
    const Eigen::Vector3d seen = state.world_from_view->conjugate() * line;
    worst_deg = std::max(worst_deg, std::atan2(seen.head<2>().norm(), seen.z()) / kDegree);
    const Eigen::Vector3d down = state.world_from_view->conjugate() * Eigen::Vector3d::UnitY();
    worst_roll_deg = std::max(worst_roll_deg, std::abs(std::atan2(-down.x(), down.y())) / kDegree);
  });
  std::printf("crop: target off the middle by at most %.2f deg, roll at most %.2f deg\n", worst_deg,
              worst_roll_deg);
  EXPECT_LT(worst_deg, 0.6);
  EXPECT_LT(worst_roll_deg, 0.6);
}

TEST(Crop, ATargetBeyondThePictureGivesTheWearerADirection) {
  CropWorld world;
  world.Run(0.5, [](const GazeSnapshot&, double) {});
  ASSERT_TRUE(world.loop().Fixate(GazePoint{{-3, 0, 0.5}}, false).ok());
  world.Run(1.0, [](const GazeSnapshot&, double) {});
  const GazeSnapshot& state = *world.loop().snapshot();
  EXPECT_FALSE(state.reachable);
  ASSERT_TRUE(state.guidance_rad);
  EXPECT_GT(std::abs(*state.guidance_rad), 150 * kDegree) << "to the left";
}

TEST(Crop, SizesThatDoNotFitAreRefused) {
  for (const auto& [width, height] : {std::pair(640, 240), std::pair(320, 500), std::pair(10, 10),
                                      std::pair(321, 240), std::pair(-2, 4)}) {
    const auto refused = CropMount::Create(Camera(), width, height);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.status().message()), ::testing::HasSubstr("--mount"));
  }
}

}  // namespace
}  // namespace saccade::crop_test
