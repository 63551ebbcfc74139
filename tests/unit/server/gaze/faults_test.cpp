#include <gmock/gmock.h>

#include <limits>

#include "tests/unit/server/gaze/closed_loop.hpp"

namespace saccade::faults_test {
namespace {

using ::testing::HasSubstr;

const Eigen::Vector3d kRight(1.5, 0, 0);

TEST(GazeFaults, NotFiniteAndOutOfRoomTargetsAreRefusedAndNothingMoves) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& bad : {Eigen::Vector3d(nan, 0, 1), Eigen::Vector3d(0, inf, 1),
                                     Eigen::Vector3d(0, 0, 400), Eigen::Vector3d(0, 0, 0.001)}) {
    const absl::Status refused = world.loop().Fixate(GazePoint{bad}, false);
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("target"));
  }
  world.Run(1.0);
  EXPECT_LT(ToVector(world.mount().TrueAngles(world.now_ns())).norm(), 0.5 * kDegree);
}

TEST(GazeFaults, ATargetThatTurnsNanLaterIsLostAndItsLastPlaceHeld) {
  ClosedLoop world(StandStill);
  FeatureSnapshot feature;
  feature.id = 7;
  feature.point_in_world = {0.5, 0, 1};
  world.map().features = {feature};
  world.Run(0.5);
  ASSERT_TRUE(world.loop().Fixate(GazeFeature{7}, false).ok());
  world.Run(2.0);
  EXPECT_TRUE(world.state().arrived);
  world.map().features[0].point_in_world.x() = std::numeric_limits<double>::quiet_NaN();
  world.Run(1.0);
  EXPECT_TRUE(world.state().target_lost);
  EXPECT_LT(world.TrueError_deg({0.5, 0, 1}), 1.0);
  world.map().features.clear();
  world.Run(1.0);
  EXPECT_TRUE(world.state().target_lost);
  EXPECT_LT(world.TrueError_deg({0.5, 0, 1}), 1.0);
}

TEST(GazeFaults, OutOfReachLooksAsNearAsItCanAndSaysSo) {
  SimMountOptions mount;
  mount.mount.of(MountJoint::kPan).min_rad = -60 * kDegree;
  mount.mount.of(MountJoint::kPan).max_rad = 60 * kDegree;
  ClosedLoop world(StandStill, {}, mount);
  world.Run(0.5);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{kRight}, false).ok());
  world.Run(4.0);
  EXPECT_FALSE(world.state().reachable);
  EXPECT_NEAR(world.state().miss_rad, 30 * kDegree, 1 * kDegree);
  EXPECT_NEAR(world.TrueError_deg(kRight), 30, 0.5);
  EXPECT_FALSE(world.state().arrived);
}

TEST(GazeFaults, UnpluggedMidSaccadeSaysSoAndGoesOnWhenItIsBack) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{kRight}, false).ok());
  world.Run(1.5);
  world.mount().SetUnplugged(true);
  world.Run(2.0);
  EXPECT_THAT(world.state().problem, HasSubstr("disconnected"));
  EXPECT_FALSE(world.state().joints_rad);
  EXPECT_FALSE(world.state().error_rad);
  const double there = world.mount().TrueAngles(world.now_ns()).pan_rad;
  world.mount().SetUnplugged(false);
  world.ResetPeak();
  world.Run(0.1);
  EXPECT_NEAR(world.mount().TrueAngles(world.now_ns()).pan_rad, there, 4 * kDegree) << "no jump";
  world.Run(3.0);
  EXPECT_LE(world.peak_rate_deg_s(), 31.5);
  EXPECT_TRUE(world.state().arrived);
  EXPECT_EQ(world.state().problem, "");
}

TEST(GazeFaults, AStuckAxisIsNamedAndNeverCountsAsArrival) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  world.mount().SetStuck(MountJoint::kPan, true);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{kRight}, false).ok());
  bool arrived = false;
  world.Run(4.0, [&] { arrived |= world.state().arrived; });
  EXPECT_FALSE(arrived);
  EXPECT_THAT(world.state().problem, HasSubstr("pan does not follow"));
  EXPECT_NEAR(*world.state().error_rad, 90 * kDegree, 1 * kDegree);
  world.mount().SetStuck(MountJoint::kPan, false);
  world.Run(4.0);
  EXPECT_TRUE(world.state().arrived);
  EXPECT_EQ(world.state().problem, "");
}

TEST(GazeFaults, LostTrackingRestsTheHeadAndGoesOnWhenItIsBack) {
  ClosedLoop world(Sway);
  world.Run(0.5);
  const Eigen::Vector3d target(0.4, 0, 1);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{target}, false).ok());
  world.Run(2.0);
  EXPECT_TRUE(world.state().arrived);
  world.SetTracking(false);
  world.Run(1.0);
  const Eigen::Vector3d rest = ToVector(world.mount().TrueAngles(world.now_ns()));
  world.Run(1.0);
  EXPECT_THAT(world.state().problem, HasSubstr("tracking is lost"));
  EXPECT_FALSE(world.state().arrived);
  EXPECT_LT((ToVector(world.mount().TrueAngles(world.now_ns())) - rest).norm(), 0.01 * kDegree);
  world.SetTracking(true);
  world.Run(2.0);
  EXPECT_TRUE(world.state().arrived);
}

TEST(GazeFaults, AWrongPoseForAMomentDoesNotTurnTheHeadAway) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  const Eigen::Vector3d target(0.4, 0, 1);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{target}, false).ok());
  world.Run(2.0);
  world.SetPoseError(ExpQuaternion({0, 40 * kDegree, 0}));
  double worst = 0;
  world.Run(0.3, [&] { worst = std::max(worst, world.TrueError_deg(target)); });
  EXPECT_LT(worst, 2.0);
  world.Run(6.0);  // but whoever insists is believed: the map may really have moved
  EXPECT_GT(world.TrueError_deg(target), 30);
  world.SetPoseError(Eigen::Quaterniond::Identity());
  world.Run(6.0);
  EXPECT_LT(world.TrueError_deg(target), 1.0);
}

TEST(GazeFaults, AResetMapForgetsTheTarget) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{kRight}, false).ok());
  world.Run(0.5);
  ++world.map().map_generation;
  world.Run(0.5);
  EXPECT_EQ(world.state().mode, GazeMode::kIdle);
  EXPECT_FALSE(world.state().target);
}

TEST(GazeFaults, StopStopsWithinAFewDegrees) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(world.loop().Fixate(GazePoint{kRight}, false).ok());
  world.Run(1.5);
  const double at = world.mount().TrueAngles(world.now_ns()).pan_rad;
  world.loop().controller().Stop();
  world.Run(1.0);
  const double end = world.mount().TrueAngles(world.now_ns()).pan_rad;
  EXPECT_LT(end - at, 3 * kDegree);
  EXPECT_GE(end, at);
}

}  // namespace
}  // namespace saccade::faults_test
