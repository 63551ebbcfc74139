#include <gmock/gmock.h>

#include "tests/unit/server/gaze/closed_loop.hpp"

namespace saccade::gaze_loop_test {
namespace {

using ::testing::HasSubstr;

const GazeCaller kAnn{{"a", "Ann"}, false}, kBob{{"b", "Bob"}, false};
const GazeCaller kWearer{{"w", "Wilma"}, true};

absl::StatusOr<LeaseAnswer> Acquire(ClosedLoop& world, const GazeCaller& caller) {
  absl::StatusOr<LeaseAnswer> result = absl::InternalError("not answered");
  world.loop().Execute(AcquireGazeLease{caller, "", [&](auto answer) { result = answer; }},
                       world.now_ns());
  return result;
}
absl::Status Fixate(ClosedLoop& world, const GazeCaller& caller, const GazeTarget& target) {
  absl::Status result = absl::InternalError("not answered");
  world.loop().Execute(
      FixateGaze{caller, target, false, [&](const auto& answer) { result = answer.status(); }},
      world.now_ns());
  return result;
}
absl::Status Steer(ClosedLoop& world, const GazeCaller& caller, SteerGaze::What what) {
  absl::Status result = absl::InternalError("not answered");
  world.loop().Execute(
      SteerGaze{caller, what, [&](const auto& answer) { result = answer.status(); }},
      world.now_ns());
  return result;
}

TEST(GazeLoop, TwoExpertsFightOneWinsTheOtherIsToldWho) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(Acquire(world, kAnn)->granted);
  EXPECT_FALSE(Acquire(world, kBob)->granted);
  const Eigen::Vector3d left(-1, 0, 1), right(1, 0, 1);
  world.Run(2.0, [&] {  // both insist, a hundred times a second
    EXPECT_TRUE(Fixate(world, kAnn, GazePoint{left}).ok());
    EXPECT_EQ(Fixate(world, kBob, GazePoint{right}).code(), absl::StatusCode::kPermissionDenied);
  });
  EXPECT_LT(world.TrueError_deg(left), 1.0);
  EXPECT_EQ(world.state().handovers, 1u);
  EXPECT_EQ(world.state().pilot->display_name, "Ann");
  ASSERT_EQ(world.state().queue.size(), 1u);
}

TEST(GazeLoop, APilotWhoVanishesMidSaccadeParksTheHead) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(Acquire(world, kAnn)->granted);
  ASSERT_TRUE(Fixate(world, kAnn, GazePoint{{1.5, 0, 0}}).ok());
  world.Run(0.4);
  EXPECT_EQ(world.state().mode, GazeMode::kSaccade);
  world.Run(0.2);
  EXPECT_EQ(world.state().mode, GazeMode::kParked);
  EXPECT_EQ(world.state().last_handover, "Ann vanished; nobody pilots");
  const double before = world.mount().TrueAngles(world.now_ns()).pan_rad;
  EXPECT_LT(before, 20 * kDegree) << "it must not go on to the target";
  world.Run(4.0);
  EXPECT_NEAR(world.mount().TrueAngles(world.now_ns()).pan_rad, 0, 0.5 * kDegree);
  EXPECT_FALSE(world.state().pilot);
}

TEST(GazeLoop, TheWearerStopsTheHeadWhoeverPilots) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(Acquire(world, kAnn)->granted);
  ASSERT_TRUE(Fixate(world, kAnn, GazePoint{{1.5, 0, 0}}).ok());
  world.Run(0.3);
  EXPECT_EQ(Steer(world, kBob, SteerGaze::What::kStop).code(), absl::StatusCode::kPermissionDenied);
  ASSERT_TRUE(Steer(world, kWearer, SteerGaze::What::kStop).ok());
  EXPECT_EQ(world.state().mode, GazeMode::kStopped);
  const double at = world.mount().TrueAngles(world.now_ns()).pan_rad;
  world.Run(0.4);
  EXPECT_LT(world.mount().TrueAngles(world.now_ns()).pan_rad - at, 4 * kDegree);
}

TEST(GazeLoop, OverrideAndPauseStopTheHeadAtOnce) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(Acquire(world, kAnn)->granted);
  ASSERT_TRUE(Fixate(world, kAnn, GazePoint{{1.5, 0, 0}}).ok());
  world.Run(0.3);
  absl::Status done;
  world.loop().Execute(OverrideGaze{kWearer, true, [&](const absl::Status& s) { done = s; }},
                       world.now_ns());
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(world.state().mode, GazeMode::kStopped);
  EXPECT_EQ(world.state().pilot->display_name, "Wilma");
  ASSERT_TRUE(Fixate(world, kWearer, GazePoint{{1, 0, 1}}).ok());
  world.Run(0.3);
  world.loop().Execute(PauseGaze{kWearer, true, [&](const absl::Status& s) { done = s; }},
                       world.now_ns());
  ASSERT_TRUE(done.ok());
  EXPECT_TRUE(world.state().paused);
  EXPECT_EQ(world.state().mode, GazeMode::kStopped);
  EXPECT_EQ(Fixate(world, kWearer, GazePoint{{1, 0, 1}}).code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(GazeLoop, UnknownTargetsAreNamed) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(Acquire(world, kAnn)->granted);
  const absl::Status feature = Fixate(world, kAnn, GazeFeature{99});
  EXPECT_EQ(feature.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(feature.message()), HasSubstr("target.feature_id: 99"));
  const absl::Status annotation = Fixate(world, kAnn, GazeAnnotation{"nope"});
  EXPECT_EQ(annotation.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(annotation.message()), HasSubstr("target.annotation_id: nope"));
}

TEST(GazeLoop, FollowsAnAnnotationThatItsAuthorMoves) {
  ClosedLoop world(StandStill);
  Annotation annotation;
  annotation.id = "cube";
  annotation.anchor.state = AnchorState::kTracking;
  annotation.anchor.point_in_world = {0.3, 0, 1};
  world.annotations() = {annotation};
  world.Run(0.5);
  ASSERT_TRUE(Acquire(world, kAnn)->granted);
  ASSERT_TRUE(Fixate(world, kAnn, GazeAnnotation{"cube"}).ok());
  const auto heartbeat = [&] { EXPECT_TRUE(Acquire(world, kAnn)->granted); };
  world.Run(1.5, heartbeat);
  EXPECT_LT(world.TrueError_deg({0.3, 0, 1}), 1.0);
  world.annotations()[0].anchor.point_in_world = {-0.3, 0.1, 1};
  world.Run(2.5, heartbeat);
  EXPECT_LT(world.TrueError_deg({-0.3, 0.1, 1}), 1.0);
  world.annotations().clear();
  world.Run(0.5, heartbeat);
  EXPECT_TRUE(world.state().target_lost);
}

TEST(GazeLoop, HomeBringsTheHeadBackAndReleaseLetsItRest) {
  ClosedLoop world(StandStill);
  world.Run(0.5);
  ASSERT_TRUE(Acquire(world, kAnn)->granted);
  const auto heartbeat = [&] { EXPECT_TRUE(Acquire(world, kAnn)->granted); };
  ASSERT_TRUE(Fixate(world, kAnn, GazePoint{{0.7, 0, 1}}).ok());
  world.Run(2.5, heartbeat);
  ASSERT_TRUE(Steer(world, kAnn, SteerGaze::What::kHome).ok());
  world.Run(2.5, heartbeat);
  EXPECT_LT(ToVector(world.mount().TrueAngles(world.now_ns())).norm(), 0.5 * kDegree);
  ASSERT_TRUE(Steer(world, kAnn, SteerGaze::What::kRelease).ok());
  EXPECT_EQ(world.state().mode, GazeMode::kIdle);
}

TEST(GazeLoop, IdleTimeGoesToTheUncertainPartOfTheMap) {
  GazeOptions options;
  options.explore_when_idle = true;
  ClosedLoop world(StandStill, options);
  for (int k = 0; k < 10; ++k) {
    FeatureSnapshot feature;
    feature.id = static_cast<FeatureId>(k);
    const bool certain = k < 5;
    feature.point_in_world = {(certain ? 1.0 : -1.0) + 0.01 * k, 0, 1};
    feature.covariance_in_world = (certain ? 1e-6 : 1e-2) * Eigen::Matrix3d::Identity();
    world.map().features.push_back(feature);
  }
  world.Run(2.0);
  EXPECT_EQ(world.state().mode, GazeMode::kExplore);
  EXPECT_LT(world.mount().TrueAngles(world.now_ns()).pan_rad, -30 * kDegree);
  ASSERT_TRUE(Acquire(world, kAnn)->granted);
  EXPECT_EQ(world.state().mode, GazeMode::kIdle) << "a pilot starts from a head at rest";
}

}  // namespace
}  // namespace saccade::gaze_loop_test
