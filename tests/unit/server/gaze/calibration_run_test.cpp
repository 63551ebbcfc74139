#include <gmock/gmock.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "tests/unit/server/gaze/closed_loop.hpp"

namespace saccade::calibration_run_test {
namespace {

using ::testing::HasSubstr;

const GazeCaller kAnn{{"a", "Ann"}, false};

/// Keeps the lease alive; a head whose pilot is silent would park.
struct Pilot {
  explicit Pilot(ClosedLoop& w) : world(w) {
    world.loop().Execute(AcquireGazeLease{kAnn, "", [&](auto answer) { lease = answer->lease_id; }},
                         world.now_ns());
  }
  absl::Status Steer(SteerGaze::What what) {
    absl::Status result = absl::InternalError("not answered");
    world.loop().Execute(
        SteerGaze{kAnn, what, [&](const auto& answer) { result = answer.status(); }},
        world.now_ns());
    return result;
  }
  void Run(double seconds) {
    world.Run(seconds, [&] {
      world.loop().Execute(AcquireGazeLease{kAnn, lease, [](auto) {}}, world.now_ns());
    });
  }
  /// Until it is over; the solver has the wall clock's time, not the simulation's.
  void Finish() {
    Run(60);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (world.state().calibration->running && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      Run(0.01);
    }
  }
  ClosedLoop& world;
  std::string lease;
};

SimMountOptions CrookedHead() {
  SimMountOptions options;
  options.truth = CrookedMount(1);
  return options;
}

/// True error while a point 50 deg aside is held, RMS of two seconds [deg].
double ErrorWith(const MountOptions& believed) {
  SimMountOptions options = CrookedHead();
  options.mount = believed;
  ClosedLoop world(StandStill, {}, options);
  world.Run(0.5);
  const Eigen::Vector3d point(1.0, -0.3, 0.8);
  EXPECT_TRUE(world.loop().Fixate(GazePoint{point}, false).ok());
  world.Run(4);
  double squares = 0;
  int count = 0;
  world.Run(2, [&] {
    squares += std::pow(world.TrueError_deg(point), 2);
    ++count;
  });
  return std::sqrt(squares / count);
}

TEST(CalibrationRun, FindsOutHowTheHeadIsBuiltAndWithThatItLooksWhereItIsTold) {
  ClosedLoop world(StandStill, {}, CrookedHead());
  world.map().metric = true;
  world.map().pose_covariance.diagonal().setConstant(1e-6);
  world.Run(0.5);
  Pilot pilot(world);
  ASSERT_TRUE(pilot.Steer(SteerGaze::What::kCalibrate).ok());
  pilot.Run(5);
  ASSERT_TRUE(world.state().calibration);
  EXPECT_TRUE(world.state().calibration->running);
  EXPECT_THAT(world.state().problem, HasSubstr("being calibrated, "));
  pilot.Finish();
  const auto report = world.state().calibration;
  EXPECT_FALSE(report->running);
  ASSERT_EQ(report->problem, "");
  EXPECT_EQ(world.state().problem, "");
  EXPECT_NEAR(report->encoder_delay_s, 0.035, 0.002);
  EXPECT_LT(report->orientation_rms_rad, 0.1 * kDegree);
  ASSERT_EQ(report->joints.size(), 3u);
  EXPECT_TRUE(report->joints[0].sign_flipped);
  EXPECT_FALSE(report->joints[1].sign_flipped);
  EXPECT_TRUE(report->joints[2].sign_flipped);

  const std::filesystem::path file = ::testing::TempDir() + "calibration_run_test.toml";
  std::ofstream(file) << report->toml;
  MountOptions found;
  ASSERT_TRUE(found.LoadToml(file).ok());
  const double before = ErrorWith({}), after = ErrorWith(found), best = ErrorWith(CrookedMount(1));
  std::printf(
      "true error of a held target: %.2f deg before, %.2f deg after, %.2f deg with the true "
      "model; delay %.1f ms, latency %.1f ms\n",
      before, after, best, 1e3 * report->encoder_delay_s, 1e3 * report->command_latency_s);
  EXPECT_GT(before, 5);
  EXPECT_LT(after, best + 0.1);
}

TEST(CalibrationRun, TheHeadRestsWhereItIsAfterwards) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{{1, 0, 1}}, false).ok());
  world.Run(3);
  Pilot pilot(world);
  ASSERT_TRUE(pilot.Steer(SteerGaze::What::kCalibrate).ok());
  pilot.Finish();
  ASSERT_FALSE(world.state().calibration->running);
  pilot.Run(1);
  EXPECT_EQ(world.state().mode, GazeMode::kIdle);
  EXPECT_LT(ToVector(world.mount().TrueAngles(world.now_ns())).norm(), 0.5 * kDegree);
}

TEST(CalibrationRun, AnyOtherCommandOrAVanishedPilotEndsIt) {
  for (const bool vanishes : {false, true}) {
    ClosedLoop world(StandStill);
    world.Run(0.5);
    Pilot pilot(world);
    ASSERT_TRUE(pilot.Steer(SteerGaze::What::kCalibrate).ok());
    pilot.Run(10);
    ASSERT_TRUE(world.state().calibration->running);
    if (vanishes) {
      world.Run(1);
    } else {
      ASSERT_TRUE(pilot.Steer(SteerGaze::What::kStop).ok());
    }
    EXPECT_FALSE(world.state().calibration->running);
    EXPECT_THAT(world.state().calibration->problem, HasSubstr("start again"));
    EXPECT_EQ(world.state().mode, vanishes ? GazeMode::kParked : GazeMode::kStopped);
  }
}

TEST(CalibrationRun, AResetMapOrAnUnpluggedMountEndsIt) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  Pilot pilot(world);
  ASSERT_TRUE(pilot.Steer(SteerGaze::What::kCalibrate).ok());
  pilot.Run(5);
  ++world.map().map_generation;
  pilot.Run(0.2);
  EXPECT_THAT(world.state().calibration->problem, HasSubstr("map was reset"));
  ASSERT_TRUE(pilot.Steer(SteerGaze::What::kCalibrate).ok());
  pilot.Run(5);
  ASSERT_TRUE(world.state().calibration->running);
  world.mount().SetUnplugged(true);
  pilot.Run(0.2);
  EXPECT_THAT(world.state().calibration->problem, HasSubstr("plug it in"));
  EXPECT_EQ(pilot.Steer(SteerGaze::What::kCalibrate).code(), absl::StatusCode::kFailedPrecondition);
}

TEST(CalibrationRun, NeedsTheLease) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  Pilot pilot(world);
  absl::Status refused;
  world.loop().Execute(SteerGaze{{{"b", "Bob"}, false},
                                 SteerGaze::What::kCalibrate,
                                 [&](const auto& answer) { refused = answer.status(); }},
                       world.now_ns());
  EXPECT_EQ(refused.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_FALSE(world.state().calibration);
}

}  // namespace
}  // namespace saccade::calibration_run_test
