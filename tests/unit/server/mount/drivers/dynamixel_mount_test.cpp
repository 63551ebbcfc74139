#include "server/mount/drivers/dynamixel_mount.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>

#include "tests/unit/server/mount/drivers/dynamixel_emulator.hpp"

namespace saccade::dynamixel_mount_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

/// The wall clock is in these tests: they wait for what shall happen, never for how long it takes.
bool Eventually(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

DynamixelOptions Quick(const std::string& device) {
  DynamixelOptions options;
  options.device = device;
  options.baud = 1'000'000;
  options.update_hz = 200;
  options.retry_s = 0.01;
  options.max_retry_s = 0.04;
  return options;
}

MountOptions OneTurn() {
  MountOptions mount;
  mount.of(MountJoint::kPan).min_rad = -90 * kDegree;
  mount.of(MountJoint::kPan).max_rad = 120 * kDegree;
  mount.of(MountJoint::kElevation).encoder_sign = -1;
  mount.of(MountJoint::kElevation).encoder_zero_rad = 45 * kDegree;
  return mount;
}

MountDemand Demand(double pan_deg, double elevation_deg) {
  MountDemand demand;
  demand.angles_rad = {pan_deg * kDegree, elevation_deg * kDegree, 0};
  demand.rate_limits_rad_s.setConstant(5.0);
  return demand;
}

class DynamixelMountTest : public ::testing::Test {
 protected:
  DynamixelMountTest() : servos_({1, 2, 3}) {}

  void Start(const MountOptions& mount = OneTurn()) { Start(Quick(servos_.device()), mount); }
  void Start(const DynamixelOptions& options, const MountOptions& mount = OneTurn()) {
    auto made = DynamixelMount::Create(options, mount);
    ASSERT_TRUE(made.ok()) << made.status();
    mount_ = *made;
  }
  bool Is(MountHealth health) {
    return Eventually([&] { return mount_->status().health == health; });
  }
  bool Reads(double pan_deg, double elevation_deg) {
    return Eventually([&] {
      const auto reading = mount_->Newest();
      return reading && std::abs(reading->angles.pan_rad - pan_deg * kDegree) < 0.1 * kDegree &&
             std::abs(reading->angles.elevation_rad - elevation_deg * kDegree) < 0.1 * kDegree;
    });
  }
  /// A reading that is newer than everything so far.
  bool ReadsOn() {
    const Timestamp now = MonotonicNow();
    return Eventually([&] {
      const auto reading = mount_->Newest();
      return reading && reading->time_ns > now;
    });
  }

  DynamixelEmulator servos_;
  std::shared_ptr<DynamixelMount> mount_;
};

TEST_F(DynamixelMountTest, ComesUpWithLimitsAndHoldsItsPlaceUnderTorque) {
  servos_.Set(1, 132, 4, 2500);
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady)) << mount_->status().problem;
  EXPECT_TRUE(mount_->status().held);
  // 4096 ticks a turn, 2048 in the middle.
  EXPECT_EQ(servos_.Get(1, 52, 4), 2048 - 1024);
  EXPECT_EQ(servos_.Get(1, 48, 4), 2048 + 1365);
  // Elevation -80 to 80, turned over and 45 deg off: raw 125 to -35.
  EXPECT_EQ(servos_.Get(2, 48, 4), 2048 + 1422);
  EXPECT_EQ(servos_.Get(2, 52, 4), 2048 - 398);
  EXPECT_EQ(servos_.Get(1, 11, 1), 3);
  for (const int id : {1, 2, 3}) EXPECT_EQ(servos_.Get(id, 64, 1), 1);
  ASSERT_TRUE(ReadsOn());
  EXPECT_NEAR(mount_->Newest()->angles.pan_rad, 452.0 / 4096 * 2 * std::numbers::pi, 1e-9);
  EXPECT_EQ(servos_.Get(1, 116, 4), 2500);
  EXPECT_EQ(servos_.Position(1), 2500);
  EXPECT_EQ(servos_.bad_packets(), 0);
}

TEST_F(DynamixelMountTest, JointsBeyondOneTurnUseTheExtendedMode) {
  Start(MountOptions());  // pan: one turn each way
  ASSERT_TRUE(Is(MountHealth::kReady)) << mount_->status().problem;
  EXPECT_EQ(servos_.Get(1, 11, 1), 4);
  MountDemand demand = Demand(300, 0);
  demand.rate_limits_rad_s.setConstant(100);
  ASSERT_TRUE(mount_->Send(demand).ok());
  EXPECT_TRUE(Reads(300, 0));
  EXPECT_EQ(servos_.Position(1), 2048 + 3413);
}

TEST_F(DynamixelMountTest, MovesWhereItIsToldWithinLimitsAndAtTheGivenRate) {
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  ASSERT_TRUE(mount_->Send(Demand(30, -20)).ok());
  EXPECT_FALSE(mount_->status().held);
  EXPECT_TRUE(Reads(30, -20));
  EXPECT_EQ(servos_.Position(1), 2048 + 341);
  EXPECT_EQ(servos_.Position(2), 2048 + 740);  // raw 45 + 20
  // 5 rad/s are 47.746 rpm, 208.5 units of 0.229 rpm.
  EXPECT_NEAR(servos_.Get(1, 112, 4), 208.5, 0.51);
  ASSERT_TRUE(mount_->Send(Demand(200, 0)).ok());
  EXPECT_TRUE(Reads(120, 0));
  MountDemand bad = Demand(0, 0);
  bad.angles_rad.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(mount_->Send(bad).code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(DynamixelMountTest, StopBrakesAndHolds) {
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  MountDemand demand = Demand(100, 0);
  demand.rate_limits_rad_s.setConstant(0.5);
  ASSERT_TRUE(mount_->Send(demand).ok());
  ASSERT_TRUE(Eventually([&] { return servos_.Position(1) > 2060; }));
  mount_->Stop();
  ASSERT_TRUE(Eventually([&] { return servos_.Position(1) == servos_.Get(1, 116, 4); }));
  EXPECT_LT(servos_.Position(1), 2048 + 1000);
  EXPECT_TRUE(mount_->status().held);
}

TEST_F(DynamixelMountTest, LostBytesAndDamagedAnswersCostAReadingNotTheMount) {
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  servos_.LoseBytes(7);
  ASSERT_TRUE(ReadsOn());
  servos_.DamageAnswers(7);
  ASSERT_TRUE(ReadsOn());
  ASSERT_TRUE(mount_->Send(Demand(10, 10)).ok());
  EXPECT_TRUE(Reads(10, 10));
  EXPECT_EQ(mount_->status().health, MountHealth::kReady) << mount_->status().problem;
}

TEST_F(DynamixelMountTest, ComesUpAlthoughAnswersAreDamaged) {
  servos_.DamageAnswers(2);
  Start();
  EXPECT_TRUE(Is(MountHealth::kReady));
}

TEST_F(DynamixelMountTest, SilenceOfAllIsDisconnectionAndBlocksNobody) {
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  ASSERT_TRUE(mount_->Send(Demand(40, 0)).ok());
  servos_.SetStalled(true);
  ASSERT_TRUE(Is(MountHealth::kDisconnected));
  EXPECT_THAT(mount_->status().problem, AllOf(HasSubstr(servos_.device()), HasSubstr("power")));
  EXPECT_FALSE(mount_->Newest());
  EXPECT_FALSE(mount_->AnglesAt(MonotonicNow()));
  const auto begin = std::chrono::steady_clock::now();
  for (int k = 0; k < 1000; ++k) {
    EXPECT_EQ(mount_->Send(Demand(10, 0)).code(), absl::StatusCode::kUnavailable);
    mount_->status();
    mount_->Newest();
  }
  // One that waited for the line would take 25 s.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
  servos_.SetStalled(false);
  EXPECT_TRUE(Is(MountHealth::kReady));
  EXPECT_TRUE(ReadsOn());
}

TEST_F(DynamixelMountTest, UnpluggedAndBackUnderItsNameItHoldsWhereItIs) {
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  MountDemand demand = Demand(100, 0);
  demand.rate_limits_rad_s.setConstant(0.2);
  ASSERT_TRUE(mount_->Send(demand).ok());
  ASSERT_TRUE(Eventually([&] { return servos_.Position(1) > 2055; }));
  servos_.Unplug();
  ASSERT_TRUE(Is(MountHealth::kDisconnected));
  EXPECT_THAT(mount_->status().problem, HasSubstr(servos_.device()));
  EXPECT_EQ(mount_->Send(demand).code(), absl::StatusCode::kUnavailable);
  EXPECT_FALSE(mount_->Newest());
  for (const int id : {1, 2, 3}) servos_.PowerCycle(id);  // it was their power as well
  EXPECT_EQ(servos_.Get(1, 64, 1), 0);
  const std::int32_t there = servos_.Position(1);
  servos_.Replug();
  ASSERT_TRUE(Is(MountHealth::kReady)) << mount_->status().problem;
  ASSERT_TRUE(ReadsOn());
  EXPECT_TRUE(mount_->status().held) << "nobody has demanded anything since";
  EXPECT_EQ(servos_.Get(1, 64, 1), 1);
  EXPECT_EQ(servos_.Position(1), there);
  ASSERT_TRUE(mount_->Send(Demand(-10, 5)).ok());
  EXPECT_TRUE(Reads(-10, 5));
}

TEST_F(DynamixelMountTest, AnOverloadedServoIsNamedAndTheOthersMove) {
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  servos_.Overload(1);
  ASSERT_TRUE(Is(MountHealth::kFault));
  EXPECT_THAT(mount_->status().problem, AllOf(HasSubstr("pan (servo 1)"), HasSubstr("overload"),
                                              HasSubstr("free the joint")));
  ASSERT_TRUE(mount_->Send(Demand(30, 15)).ok());
  EXPECT_TRUE(Reads(0, 15));
  servos_.PowerCycle(1);  // torque is off now, and no error says so
  EXPECT_TRUE(Is(MountHealth::kReady));
  EXPECT_TRUE(Reads(30, 15));
  EXPECT_EQ(servos_.Get(1, 64, 1), 1);
}

TEST_F(DynamixelMountTest, AServoThatIsNotThereIsNamedAndMayComeLater) {
  servos_.SetAbsent(3, true);
  Start();
  ASSERT_TRUE(Eventually([&] {
    return mount_->status().problem.find("cyclotorsion (servo 3)") != std::string::npos;
  }));
  EXPECT_EQ(mount_->status().health, MountHealth::kDisconnected);
  EXPECT_THAT(mount_->status().problem,
              AllOf(HasSubstr(servos_.device()), HasSubstr("1000000 baud"),
                    HasSubstr("dynamixel.cyclotorsion.id")));
  servos_.SetAbsent(3, false);
  EXPECT_TRUE(Is(MountHealth::kReady));
}

TEST_F(DynamixelMountTest, AServoThatGoesSilentIsNamedWhileTheOthersMove) {
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  servos_.SetAbsent(3, true);
  ASSERT_TRUE(Is(MountHealth::kFault));
  EXPECT_THAT(mount_->status().problem, HasSubstr("cyclotorsion (servo 3)"));
  EXPECT_FALSE(mount_->Newest());
  ASSERT_TRUE(mount_->Send(Demand(30, 0)).ok());
  EXPECT_TRUE(Eventually([&] { return servos_.Position(1) == 2048 + 341; }));
  servos_.SetAbsent(3, false);
  EXPECT_TRUE(Is(MountHealth::kReady));
  EXPECT_TRUE(Reads(30, 0));
}

TEST_F(DynamixelMountTest, JointsWithoutAMotorStayAtZero) {
  DynamixelOptions options = Quick(servos_.device());
  options.servos[2].id = -1;
  servos_.SetAbsent(3, true);
  Start(options);
  ASSERT_TRUE(Is(MountHealth::kReady)) << mount_->status().problem;
  ASSERT_TRUE(mount_->Send(Demand(20, 10)).ok());
  EXPECT_TRUE(Reads(20, 10));
  EXPECT_EQ(mount_->Newest()->angles.cyclotorsion_rad, 0);
  EXPECT_LT(mount_->model().options().of(MountJoint::kCyclotorsion).max_rad, 1e-3);
}

TEST_F(DynamixelMountTest, ReadingsAreStampedInTheMiddleOfTheTransaction) {
  servos_.SetAnswerTime(0.02);  // either end would be 10 ms off
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  MountDemand demand = Demand(115, 0);
  demand.rate_limits_rad_s.setConstant(2);
  ASSERT_TRUE(mount_->Send(demand).ok());
  std::vector<EncoderReading> readings;
  ASSERT_TRUE(Eventually([&] {
    const auto reading = mount_->Newest();
    if (reading && (readings.empty() || reading->time_ns != readings.back().time_ns)) {
      readings.push_back(*reading);
    }
    return readings.size() >= 25;
  }));
  const auto samples = servos_.samples();
  std::vector<double> off_ms;
  for (const EncoderReading& reading : readings) {
    const long ticks = std::lround(reading.angles.pan_rad / (2 * std::numbers::pi) * 4096) + 2048;
    const auto same = [&](const auto& one) { return one.position == ticks; };
    // Positions that were read once only, while it moved.
    if (std::count_if(samples.begin(), samples.end(), same) != 1) continue;
    const auto sample = std::find_if(samples.begin(), samples.end(), same);
    off_ms.push_back(1e3 * Seconds(reading.time_ns - sample->time_ns));
  }
  ASSERT_GE(off_ms.size(), 8u);
  std::nth_element(off_ms.begin(), off_ms.begin() + off_ms.size() / 2, off_ms.end());
  EXPECT_LT(std::abs(off_ms[off_ms.size() / 2]), 4.0);
}

TEST_F(DynamixelMountTest, AtTheEndItHoldsOrLetsGoAsConfigured) {
  Start();
  ASSERT_TRUE(Is(MountHealth::kReady));
  mount_.reset();
  EXPECT_EQ(servos_.Get(1, 64, 1), 1);
  DynamixelOptions options = Quick(servos_.device());
  options.release_at_end = true;
  Start(options);
  ASSERT_TRUE(Is(MountHealth::kReady));
  mount_.reset();
  EXPECT_EQ(servos_.Get(1, 64, 1), 0);
}

TEST(DynamixelMount, AMissingDeviceIsNamedWithARemedyAndNoError) {
  auto mount = DynamixelMount::Create(Quick("/dev/saccade_no_such_device"), MountOptions());
  ASSERT_TRUE(mount.ok());
  ASSERT_TRUE(Eventually(
      [&] { return (*mount)->status().problem.find("no such device") != std::string::npos; }));
  EXPECT_THAT((*mount)->status().problem,
              AllOf(HasSubstr("/dev/saccade_no_such_device"), HasSubstr("plug")));
  EXPECT_EQ((*mount)->Send(Demand(0, 0)).code(), absl::StatusCode::kUnavailable);
}

TEST(DynamixelOptions, ReadsItsTableAndTheUriWins) {
  const std::filesystem::path file = ::testing::TempDir() + "dynamixel_options_test.toml";
  std::ofstream(file) << "[dynamixel]\nbaud = 115200\nupdate_hz = 50\nrelease_at_end = true\n"
                         "[dynamixel.pan]\nid = 11\nticks_per_turn = 8192\n"
                         "[dynamixel.cyclotorsion]\nid = -1\n";
  DynamixelOptions options;
  ASSERT_TRUE(options.LoadToml(file).ok());
  EXPECT_EQ(options.servos[0].id, 11);
  EXPECT_EQ(options.servos[0].ticks_per_turn, 8192);
  EXPECT_EQ(options.servos[2].id, -1);
  EXPECT_TRUE(options.release_at_end);
  ASSERT_TRUE(options.ReadUri("/dev/ttyUSB0").ok());
  EXPECT_EQ(options.baud, 115200);
  ASSERT_TRUE(options.ReadUri("/dev/ttyUSB0?baud=1000000").ok());
  EXPECT_EQ(options.baud, 1'000'000);
  EXPECT_EQ(options.device, "/dev/ttyUSB0");
  for (const char* bad :
       {"", "?baud=57600", "/dev/x?bauds=1", "/dev/x?baud=fast", "/dev/x?baud=-3", "/dev/x?"}) {
    EXPECT_EQ(options.ReadUri(bad).code(), absl::StatusCode::kInvalidArgument) << bad;
  }
}

TEST(DynamixelOptions, ErrorsNameFileFieldAndRemedy) {
  const std::filesystem::path file = ::testing::TempDir() + "dynamixel_errors_test.toml";
  for (const auto& [text, field, remedy] :
       {std::tuple("[dynamixel]\nspeed = 1\n", "dynamixel.speed", "known: baud"),
        std::tuple("[dynamixel]\nbaud = 12\n", "dynamixel.baud", "from 9600"),
        std::tuple("[dynamixel]\nbaud = 57600.5\n", "dynamixel.baud", "whole number"),
        std::tuple("[dynamixel.pan]\nid = 2\n", "dynamixel.elevation.id", "its own number"),
        std::tuple("[dynamixel.pan]\nid = 300\n", "dynamixel.pan.id", "from 0 to 252"),
        std::tuple("[dynamixel.pan]\nspeed = 3\n", "dynamixel.pan.speed", "known: id")}) {
    std::ofstream(file) << text;
    DynamixelOptions options;
    const absl::Status status = options.LoadToml(file);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("dynamixel_errors_test.toml"),
                                                     HasSubstr(field), HasSubstr(remedy)));
  }
}

}  // namespace
}  // namespace saccade::dynamixel_mount_test
