#include "server/eval/points_world.hpp"

#include <gtest/gtest.h>

namespace saccade::points_world_test {
namespace {

TEST(PointsWorld, SameSeedSameWorld) {
  PointsOptions options;
  options.duration_s = 2;
  const PointsWorld a = MakePointsWorld(options), b = MakePointsWorld(options);
  options.seed = 2;
  const PointsWorld c = MakePointsWorld(options);
  EXPECT_EQ(a.frames.back().observations.size(), b.frames.back().observations.size());
  EXPECT_EQ(a.frames.back().world_from_camera.translation,
            b.frames.back().world_from_camera.translation);
  EXPECT_NE(a.frames.back().world_from_camera.translation,
            c.frames.back().world_from_camera.translation);
}

TEST(PointsWorld, WearerStaysInTheRoomAndSeesEnough) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    PointsOptions options;
    options.seed = seed;
    const PointsWorld world = MakePointsWorld(options);
    EXPECT_EQ(world.frames.size(), 1800);
    for (const PointsFrame& frame : world.frames) {
      ASSERT_LT(frame.world_from_camera.translation.cwiseAbs().maxCoeff(), 1.2) << seed;
      ASSERT_GT(frame.observations.size(), 5) << seed;
    }
    int target = 0;
    for (const auto& each : world.frames.front().observations) target += each.point < 6 ? 1 : 0;
    EXPECT_EQ(target, 6);
  }
}

TEST(PointsWorld, NoiseHasTheSigmaAskedFor) {
  PointsOptions options;
  options.duration_s = 10;
  const PointsWorld world = MakePointsWorld(options);
  double squares = 0, sum = 0;
  int count = 0;
  for (const PointsFrame& frame : world.frames) {
    for (const PointObservation& each : frame.observations) {
      const auto exact =
          world.camera.Project(frame.world_from_camera.Inverse() * world.points[each.point]);
      const Eigen::Vector2d error = each.pixel - *exact;
      squares += error.squaredNorm();
      sum += error.sum();
      count += 2;
    }
  }
  EXPECT_NEAR(squares / count, 1.0, 0.03);
  EXPECT_NEAR(sum / count, 0.0, 0.02);
}

}  // namespace
}  // namespace saccade::points_world_test
