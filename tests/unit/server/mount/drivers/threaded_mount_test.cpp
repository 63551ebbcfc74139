#include "server/mount/drivers/threaded_mount.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>

namespace saccade::threaded_mount_test {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

bool Eventually(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(milliseconds(1));
  }
  return true;
}

/// Joints that are at once where they are told, on a line that the test cuts.
class PlainMount final : public ThreadedMount {
 public:
  PlainMount()
      : ThreadedMount(MountOptions(), {.retry_s = 0.002, .max_retry_s = 0.004},
                      {MountHealth::kDisconnected, "mount: not yet", false}) {
    Start();
  }
  ~PlainMount() override { End(); }

  std::atomic<bool> cut = false;
  std::atomic<int> sessions = 0, brakes = 0;

 private:
  absl::Status Session(const std::stop_token& stop) override {
    if (cut) return absl::UnavailableError("still cut; join it");
    ++sessions;
    Eigen::Vector3d angles = Eigen::Vector3d::Zero();
    do {
      if (cut) return absl::UnavailableError("the line is cut; join it");
      if (const std::optional<Goal> goal = Demanded(0)) angles = goal->angles_rad;
      if (TakeBrake()) ++brakes;
      AddReading(MonotonicNow(), angles);
      Report("");
    } while (WaitUntil(Clock::now() + milliseconds(1), stop));
    return absl::OkStatus();
  }
};

MountDemand Pan(double angle_rad, double rate_rad_s = 0) {
  MountDemand demand;
  demand.angles_rad.x() = angle_rad;
  demand.rates_rad_s.x() = rate_rad_s;
  return demand;
}

TEST(ThreadedMount, ForgetsWhatWasDemandedBeforeALossAndComesBack) {
  PlainMount mount;
  ASSERT_TRUE(Eventually([&] { return mount.status().health == MountHealth::kReady; }));
  EXPECT_TRUE(mount.status().held);
  ASSERT_TRUE(mount.Send(Pan(0.5)).ok());
  EXPECT_FALSE(mount.status().held);
  ASSERT_TRUE(Eventually([&] { return mount.Newest()->angles.pan_rad == 0.5; }));
  mount.cut = true;
  ASSERT_TRUE(Eventually([&] { return mount.status().health == MountHealth::kDisconnected; }));
  EXPECT_THAT(mount.status().problem, HasSubstr("mount: "));
  EXPECT_THAT(mount.status().problem, HasSubstr("cut; join it"));
  EXPECT_FALSE(mount.Newest());
  EXPECT_EQ(mount.Send(Pan(0.1)).code(), absl::StatusCode::kUnavailable);
  mount.cut = false;
  ASSERT_TRUE(Eventually([&] { return mount.status().health == MountHealth::kReady; }));
  EXPECT_TRUE(mount.status().held);
  EXPECT_EQ(mount.Newest()->angles.pan_rad, 0.0);
  EXPECT_EQ(mount.sessions, 2);
}

TEST(ThreadedMount, StopsOnceAndCarriesARateForATenthOfASecond) {
  PlainMount mount;
  ASSERT_TRUE(Eventually([&] { return mount.status().health == MountHealth::kReady; }));
  mount.Stop();  // nothing to stop
  ASSERT_TRUE(mount.Send(Pan(0, 1.0)).ok());
  ASSERT_TRUE(Eventually([&] { return mount.Newest()->angles.pan_rad >= kDemandHeld_s; }));
  std::this_thread::sleep_for(milliseconds(20));
  EXPECT_EQ(mount.Newest()->angles.pan_rad, kDemandHeld_s);
  mount.Stop();
  mount.Stop();
  EXPECT_TRUE(mount.status().held);
  ASSERT_TRUE(Eventually([&] { return mount.brakes > 0; }));
  std::this_thread::sleep_for(milliseconds(10));
  EXPECT_EQ(mount.brakes, 1);
}

TEST(ThreadedMount, RefusesWhatIsNotFinite) {
  PlainMount mount;
  MountDemand demand = Pan(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(mount.Send(demand).code(), absl::StatusCode::kInvalidArgument);
  demand = Pan(0);
  demand.rate_limits_rad_s.x() = -1;
  EXPECT_EQ(mount.Send(demand).code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace saccade::threaded_mount_test
