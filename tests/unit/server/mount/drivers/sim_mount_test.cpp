#include "server/mount/drivers/sim_mount.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace saccade::sim_mount_test {
namespace {

constexpr Timestamp kMs = 1'000'000;
constexpr double kDegree = std::numbers::pi / 180.0;

MountDemand Pan(double degrees) {
  MountDemand demand;
  demand.angles_rad.x() = degrees * kDegree;
  return demand;
}

/// Sends `demand` every 10 ms until `until`; answers with the highest rate and acceleration seen.
struct Peaks {
  double rate = 0, acceleration = 0;
};
Peaks Hold(SimMount& mount, const MountDemand& demand, Timestamp from, Timestamp until) {
  Peaks peaks;
  double last = mount.TrueAngles(from).pan_rad, last_rate = 0;
  for (Timestamp t = from; t < until; t += kMs) {
    if ((t - from) % (10 * kMs) == 0) {
      EXPECT_TRUE(mount.Send(demand).ok());
    }
    mount.AdvanceTo(t + kMs);
    const double now = mount.TrueAngles(t + kMs).pan_rad;
    const double rate = (now - last) / 1e-3;
    peaks.rate = std::max(peaks.rate, std::abs(rate));
    peaks.acceleration = std::max(peaks.acceleration, std::abs(rate - last_rate) / 1e-3);
    last = now;
    last_rate = rate;
  }
  return peaks;
}

TEST(SimMount, ObeysItsLimitsAndArrivesWithoutOvershoot) {
  SimMountOptions options;
  options.mount.of(MountJoint::kPan).max_rate_rad_s = 120 * kDegree;
  options.mount.of(MountJoint::kPan).max_acceleration_rad_s2 = 800 * kDegree;
  SimMount mount(options);
  mount.AdvanceTo(0);
  const Peaks peaks = Hold(mount, Pan(90), 0, 2000 * kMs);
  EXPECT_LE(peaks.rate, 120.01 * kDegree);
  EXPECT_GE(peaks.rate, 119 * kDegree);
  EXPECT_LE(peaks.acceleration, 801 * kDegree);
  EXPECT_NEAR(mount.TrueAngles(2000 * kMs).pan_rad, 90 * kDegree, 0.01 * kDegree);
  for (int t = 0; t < 2000; ++t) {
    EXPECT_LT(mount.TrueAngles(t * kMs).pan_rad, 90.05 * kDegree);
  }
}

TEST(SimMount, StartsAfterTheCommandLatency) {
  SimMountOptions options;
  options.mount.command_latency_s = 0.04;
  SimMount mount(options);
  mount.AdvanceTo(0);
  ASSERT_TRUE(mount.Send(Pan(30)).ok());
  mount.AdvanceTo(39 * kMs);
  EXPECT_EQ(mount.TrueAngles(39 * kMs).pan_rad, 0);
  mount.AdvanceTo(60 * kMs);
  EXPECT_GT(mount.TrueAngles(60 * kMs).pan_rad, 0);
}

TEST(SimMount, EncodersHaveTheStatedNoiseAndTheSameSeedTheSameReadings) {
  SimMountOptions options;
  SimMount mount(options), same(options);
  double sum = 0, squares = 0;
  constexpr int kReadings = 2000;
  for (int k = 0; k < kReadings; ++k) {
    mount.AdvanceTo(k * 10 * kMs);
    same.AdvanceTo(k * 10 * kMs);
    const auto reading = mount.Newest();
    ASSERT_TRUE(reading);
    EXPECT_EQ(reading->time_ns, k * 10 * kMs);
    EXPECT_EQ(reading->angles.pan_rad, same.Newest()->angles.pan_rad);
    sum += reading->angles.pan_rad;
    squares += reading->angles.pan_rad * reading->angles.pan_rad;
  }
  EXPECT_NEAR(std::sqrt(squares / kReadings), 0.1 * kDegree, 0.006 * kDegree);
  EXPECT_NEAR(sum / kReadings, 0, 0.01 * kDegree);
}

TEST(SimMount, ClampsToItsLimitsAndRefusesWhatIsNotFinite) {
  SimMount mount({});
  mount.AdvanceTo(0);
  Hold(mount, Pan(400), 0, 2500 * kMs);
  EXPECT_NEAR(mount.TrueAngles(2500 * kMs).pan_rad, 360 * kDegree, 0.05 * kDegree);
  EXPECT_EQ(mount.Send(Pan(std::numeric_limits<double>::quiet_NaN())).code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(SimMount, StopBrakesAndHolds) {
  SimMount mount({});
  mount.AdvanceTo(0);
  Hold(mount, Pan(90), 0, 200 * kMs);
  mount.Stop();
  mount.AdvanceTo(400 * kMs);
  const double rest = mount.TrueAngles(400 * kMs).pan_rad;
  EXPECT_LT(rest, 80 * kDegree);
  mount.AdvanceTo(2000 * kMs);
  EXPECT_EQ(mount.TrueAngles(2000 * kMs).pan_rad, rest);
}

TEST(SimMount, UnpluggedIsSilentRefusesAndComesBackWhereItWas) {
  SimMount mount({});
  mount.AdvanceTo(0);
  Hold(mount, Pan(90), 0, 200 * kMs);
  const double there = mount.TrueAngles(200 * kMs).pan_rad;
  mount.SetUnplugged(true);
  EXPECT_EQ(mount.status().health, MountHealth::kDisconnected);
  EXPECT_EQ(mount.Send(Pan(10)).code(), absl::StatusCode::kUnavailable);
  mount.AdvanceTo(900 * kMs);
  EXPECT_FALSE(mount.Newest());
  EXPECT_FALSE(mount.AnglesAt(900 * kMs));
  EXPECT_EQ(mount.TrueAngles(900 * kMs).pan_rad, there);
  mount.SetUnplugged(false);
  mount.AdvanceTo(1000 * kMs);
  EXPECT_EQ(mount.status().health, MountHealth::kReady);
  ASSERT_TRUE(mount.Newest());
  EXPECT_NEAR(mount.TrueAngles(1000 * kMs).pan_rad, there, 1e-9);
}

TEST(SimMount, AStuckAxisIsReportedByNameAndTheOthersMove) {
  SimMount mount({});
  mount.AdvanceTo(0);
  mount.SetStuck(MountJoint::kPan, true);
  MountDemand demand = Pan(40);
  demand.angles_rad.y() = 20 * kDegree;
  Hold(mount, demand, 0, 1000 * kMs);
  EXPECT_EQ(mount.TrueAngles(1000 * kMs).pan_rad, 0);
  EXPECT_NEAR(mount.TrueAngles(1000 * kMs).elevation_rad, 20 * kDegree, 0.01);
  EXPECT_EQ(mount.status().health, MountHealth::kFault);
  EXPECT_THAT(mount.status().problem, ::testing::HasSubstr("pan"));
  mount.SetStuck(MountJoint::kPan, false);
  Hold(mount, demand, 1000 * kMs, 2000 * kMs);
  EXPECT_EQ(mount.status().health, MountHealth::kReady);
}

}  // namespace
}  // namespace saccade::sim_mount_test
