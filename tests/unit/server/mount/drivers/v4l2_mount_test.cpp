#include "server/mount/drivers/v4l2_mount.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <chrono>
#include <fstream>
#include <map>
#include <mutex>
#include <numbers>

#include "server/mount/fixed_joint.hpp"

namespace saccade::v4l2_mount_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr Timestamp kMs = 1'000'000;

/// A camera as the kernel shows it; outlives the devices that are opened on it.
struct FakeCamera {
  struct Control {
    std::int32_t least, most, step, value;
    std::uint32_t flags = 0;
  };
  std::mutex mutex;
  std::map<std::uint32_t, Control> controls;
  std::map<std::uint32_t, std::int32_t> moved;  // sums of relative controls
  int sets = 0, opened = 0;
  bool plugged = true;
  int refuse = 0;  // errno of every set

  int Ioctl(unsigned long request, void* argument) {
    const std::lock_guard lock(mutex);
    if (!plugged) return ENODEV;
    if (request == VIDIOC_QUERYCTRL) {
      auto& query = *static_cast<v4l2_queryctrl*>(argument);
      const auto found = controls.find(query.id);
      if (found == controls.end()) return EINVAL;
      query.minimum = found->second.least;
      query.maximum = found->second.most;
      query.step = found->second.step;
      query.flags = found->second.flags;
      return 0;
    }
    auto& all = *static_cast<v4l2_ext_controls*>(argument);
    if (all.ctrl_class != V4L2_CTRL_CLASS_CAMERA) return EINVAL;
    if (request == VIDIOC_S_EXT_CTRLS && refuse != 0) {
      all.error_idx = all.count;
      return refuse;
    }
    sets += request == VIDIOC_S_EXT_CTRLS;
    for (std::uint32_t k = 0; k < all.count; ++k) {
      const auto found = controls.find(all.controls[k].id);
      all.error_idx = k;
      if (found == controls.end()) return EINVAL;
      Control& control = found->second;
      const bool relative =
          found->first == V4L2_CID_PAN_RELATIVE || found->first == V4L2_CID_TILT_RELATIVE;
      if (request == VIDIOC_G_EXT_CTRLS) {
        if (relative) return EACCES;
        all.controls[k].value = control.value;
      } else if (request == VIDIOC_S_EXT_CTRLS) {
        const std::int32_t value = all.controls[k].value;
        if (value < control.least || value > control.most) return ERANGE;
        if ((value - control.least) % control.step != 0) return EINVAL;
        control.value = value;
        if (relative) moved[found->first] += value;
      } else {
        return ENOTTY;
      }
    }
    return 0;
  }
};

class FakeDevice final : public VideoDevice {
 public:
  explicit FakeDevice(std::shared_ptr<FakeCamera> camera) : camera_(std::move(camera)) {}
  int Ioctl(unsigned long request, void* argument) override {
    return camera_->Ioctl(request, argument);
  }

 private:
  std::shared_ptr<FakeCamera> camera_;
};

std::shared_ptr<FakeCamera> AbsoluteCamera() {
  auto camera = std::make_shared<FakeCamera>();
  camera->controls[V4L2_CID_PAN_ABSOLUTE] = {-36000 * 10, 36000 * 10, 3600, 0};
  camera->controls[V4L2_CID_TILT_ABSOLUTE] = {-36000 * 3, 36000 * 3, 3600, 7200};
  camera->controls[V4L2_CID_ZOOM_ABSOLUTE] = {100, 500, 10, 100};
  return camera;
}

absl::StatusOr<std::unique_ptr<V4l2Head>> Open(const std::shared_ptr<FakeCamera>& camera,
                                               V4l2Options options = {},
                                               const MountOptions& mount = {}) {
  options.device = "/dev/video7";
  return V4l2Head::Open(options, mount, std::make_unique<FakeDevice>(camera));
}

TEST(V4l2Head, TakesLimitsFromTheCameraAndFixesWhatItLacks) {
  const auto head = Open(AbsoluteCamera());
  ASSERT_TRUE(head.ok()) << head.status();
  const MountOptions& mount = (*head)->mount();
  EXPECT_NEAR(mount.of(MountJoint::kPan).min_rad, -100 * kDegree, 1e-9);
  EXPECT_NEAR(mount.of(MountJoint::kPan).max_rad, 100 * kDegree, 1e-9);
  EXPECT_NEAR(mount.of(MountJoint::kElevation).max_rad, 30 * kDegree, 1e-9);
  EXPECT_TRUE(IsFixed(mount.of(MountJoint::kCyclotorsion)));
  EXPECT_TRUE(mount.Validate().ok());
  EXPECT_NEAR((*head)->angles_rad().y(), 2 * kDegree, 1e-9);
  EXPECT_GE(mount.encoder_sigma_rad, 1 * kDegree);
}

TEST(V4l2Head, SendsPanAndTiltTogetherInStepsAndOnlyWhatChanges) {
  const auto camera = AbsoluteCamera();
  MountOptions mount;
  mount.of(MountJoint::kElevation).encoder_sign = -1;
  auto head = Open(camera, {}, mount);
  ASSERT_TRUE(head.ok());
  ASSERT_TRUE((*head)->Step(0, {20.4 * kDegree, 10 * kDegree, 0}).ok());
  EXPECT_EQ(camera->sets, 1);
  EXPECT_EQ(camera->controls[V4L2_CID_PAN_ABSOLUTE].value, 20 * 3600);  // steps of a degree
  EXPECT_EQ(camera->controls[V4L2_CID_TILT_ABSOLUTE].value, -10 * 3600);
  ASSERT_TRUE((*head)->Step(50 * kMs, {20.3 * kDegree, 10 * kDegree, 0}).ok());
  EXPECT_EQ(camera->sets, 1);
  ASSERT_TRUE((*head)->Step(100 * kMs, {500 * kDegree, -70 * kDegree, 0}).ok());
  EXPECT_EQ(camera->controls[V4L2_CID_PAN_ABSOLUTE].value, 360000);
  EXPECT_EQ(camera->controls[V4L2_CID_TILT_ABSOLUTE].value, 30 * 3600);
}

TEST(V4l2Head, ReckonsWhereItIsByItsSpeedOrReadsIt) {
  const auto camera = AbsoluteCamera();
  MountOptions mount;
  mount.of(MountJoint::kPan).max_rate_rad_s = 100 * kDegree;
  auto head = Open(camera, {}, mount);
  ASSERT_TRUE(head.ok());
  const Eigen::Vector3d goal(50 * kDegree, 0, 0);
  ASSERT_TRUE((*head)->Step(0, goal).ok());
  ASSERT_TRUE((*head)->Step(200 * kMs, goal).ok());
  EXPECT_NEAR((*head)->angles_rad().x(), 20 * kDegree, 1e-9);
  ASSERT_TRUE((*head)->Step(2000 * kMs, goal).ok());
  EXPECT_NEAR((*head)->angles_rad().x(), 50 * kDegree, 1e-9);
  V4l2Options reads;
  reads.read_back = true;
  auto other = Open(camera, reads);
  ASSERT_TRUE(other.ok());
  camera->controls[V4L2_CID_PAN_ABSOLUTE].value = 7 * 3600;
  ASSERT_TRUE((*other)->Step(0, goal).ok());
  EXPECT_NEAR((*other)->angles_rad().x(), 7 * kDegree, 1e-9);
}

TEST(V4l2Head, CamerasWithRelativeControlsAreResetAndCounted) {
  auto camera = std::make_shared<FakeCamera>();
  camera->controls[V4L2_CID_PAN_RELATIVE] = {-640, 640, 1, 0};
  camera->controls[V4L2_CID_PAN_RESET] = {0, 1, 1, 0};
  camera->controls[V4L2_CID_TILT_ABSOLUTE] = {0, 0, 1, 0, V4L2_CTRL_FLAG_DISABLED};
  auto head = Open(camera);
  ASSERT_TRUE(head.ok()) << head.status();
  EXPECT_EQ(camera->controls[V4L2_CID_PAN_RESET].value, 1);
  EXPECT_TRUE(IsFixed((*head)->mount().of(MountJoint::kElevation)));
  for (int k = 0; k < 5; ++k) ASSERT_TRUE((*head)->Step(k * 50 * kMs, {15 * kDegree, 0, 0}).ok());
  EXPECT_EQ(camera->moved[V4L2_CID_PAN_RELATIVE], 15 * 64);  // 640 and 320, then nothing
  ASSERT_TRUE((*head)->Step(400 * kMs, {-2 * kDegree, 0, 0}).ok());
  ASSERT_TRUE((*head)->Step(450 * kMs, {-2 * kDegree, 0, 0}).ok());
  EXPECT_EQ(camera->moved[V4L2_CID_PAN_RELATIVE], -2 * 64);
}

TEST(V4l2Head, SetsTheZoomOrSaysThatThereIsNone) {
  const auto camera = AbsoluteCamera();
  V4l2Options options;
  options.zoom = 0.5;
  ASSERT_TRUE(Open(camera, options).ok());
  EXPECT_EQ(camera->controls[V4L2_CID_ZOOM_ABSOLUTE].value, 300);
  camera->controls.erase(V4L2_CID_ZOOM_ABSOLUTE);
  const absl::Status none = Open(camera, options).status();
  EXPECT_EQ(none.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(none.message()), AllOf(HasSubstr("v4l2.zoom"), HasSubstr("/dev/video7")));
}

TEST(V4l2Head, ACameraThatCannotTurnIsRefusedWithARemedy) {
  const absl::Status refused = Open(std::make_shared<FakeCamera>()).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), AllOf(HasSubstr("/dev/video7"), HasSubstr("crop:")));
}

TEST(V4l2Head, ErrorsOfTheSystemNameDeviceControlAndRemedy) {
  const auto camera = AbsoluteCamera();
  auto head = Open(camera);
  ASSERT_TRUE(head.ok());
  camera->refuse = EBUSY;
  const absl::Status busy = (*head)->Step(0, {0.3, 0, 0});
  EXPECT_EQ(busy.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(busy.message()),
              AllOf(HasSubstr("/dev/video7"), HasSubstr("pan (absolute)"), HasSubstr("close")));
  camera->refuse = 0;
  ASSERT_TRUE((*head)->Step(10, {0.3, 0, 0}).ok());
  EXPECT_NE(camera->controls[V4L2_CID_PAN_ABSOLUTE].value, 0) << "what was refused is sent again";
  camera->plugged = false;
  EXPECT_EQ((*head)->Step(20, {0.6, 0, 0}).code(), absl::StatusCode::kUnavailable);
}

TEST(V4l2Options, ErrorsNameFileFieldAndRange) {
  const std::filesystem::path file = ::testing::TempDir() + "v4l2_options_test.toml";
  V4l2Options options;
  std::ofstream(file) << "[v4l2]\nzoom = 0.25\nread_back = true\nupdate_hz = 10\n";
  ASSERT_TRUE(options.LoadToml(file).ok());
  EXPECT_EQ(options.zoom, 0.25);
  for (const auto& [text, words] : {std::pair("[v4l2]\nzoom = 2\n", "v4l2.zoom: 2; give"),
                                    std::pair("[v4l2]\nupdate_hz = 0\n", "from 1 to 200"),
                                    std::pair("[v4l2]\nspeed = 1\n", "v4l2.speed: unknown")}) {
    std::ofstream(file) << text;
    const absl::Status status = options.LoadToml(file);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()),
                AllOf(HasSubstr("v4l2_options_test.toml"), HasSubstr(words)));
  }
}

bool Eventually(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

TEST(V4l2Mount, FollowsDemandsAndFindsItsCameraAgain) {
  const auto camera = AbsoluteCamera();
  const OpenVideoDevice open =
      [camera](const std::string& path) -> absl::StatusOr<std::unique_ptr<VideoDevice>> {
    const std::lock_guard lock(camera->mutex);
    if (!camera->plugged) return absl::NotFoundError(path);
    ++camera->opened;
    return std::make_unique<FakeDevice>(camera);
  };
  V4l2Options options;
  options.device = "/dev/video7";
  options.update_hz = 100;
  options.retry_s = options.max_retry_s = 0.01;
  const auto made = V4l2Mount::Create(options, {}, open);
  ASSERT_TRUE(made.ok()) << made.status();
  V4l2Mount& mount = **made;
  EXPECT_TRUE(mount.status().held);
  MountDemand demand;
  demand.angles_rad.x() = 10 * kDegree;
  ASSERT_TRUE(mount.Send(demand).ok());
  EXPECT_TRUE(Eventually([&] {
    const auto reading = mount.Newest();
    return reading && std::abs(reading->angles.pan_rad - 10 * kDegree) < 1e-6;
  }));
  const auto plug = [&](bool in) {
    const std::lock_guard lock(camera->mutex);
    camera->plugged = in;
  };
  plug(false);
  ASSERT_TRUE(Eventually([&] { return mount.status().health == MountHealth::kDisconnected; }));
  EXPECT_THAT(mount.status().problem, AllOf(HasSubstr("/dev/video7"), HasSubstr("plug")));
  EXPECT_EQ(mount.Send(demand).code(), absl::StatusCode::kUnavailable);
  EXPECT_FALSE(mount.Newest());
  plug(true);
  ASSERT_TRUE(Eventually([&] { return mount.status().health == MountHealth::kReady; }));
  EXPECT_TRUE(mount.Send(demand).ok());
  EXPECT_EQ(camera->opened, 2);
}

TEST(V4l2Mount, AMissingCameraIsAnErrorThatNamesIt) {
  V4l2Options options;
  options.device = "/dev/saccade_no_such_camera";
  const absl::Status missing = V4l2Mount::Create(options, {}).status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(missing.message()), HasSubstr("/dev/saccade_no_such_camera"));
}

}  // namespace
}  // namespace saccade::v4l2_mount_test
