#include "server/filter/parallax.hpp"

#include <gtest/gtest.h>

#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::parallax_test {
namespace {

/// Matches of one clone: a turn, parallax of `parallax_px`, and unit noise.
std::vector<TurnResidual> Matches(RandomWorld& world, int count, double parallax_px) {
  const CameraModel lens = TestCamera();
  const Eigen::Vector3d turn = world.NormalVector<3>(0.01);
  std::vector<TurnResidual> matches;
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector3d ray =
        *lens.Unproject({world.Uniform(20, 620), world.Uniform(20, 460)}) * world.Uniform(1, 3);
    const auto at = PredictFixed(lens, Rigid3(), ray);
    TurnResidual match;
    match.d_rotation = at->d_camera.rightCols<3>();
    match.residual = match.d_rotation * turn + world.NormalVector<2>(1.0);
    match.residual.x() += parallax_px * world.Uniform(0.5, 1.5);
    match.noise.setIdentity();
    matches.push_back(match);
  }
  return matches;
}

TEST(Parallax, ATurnAloneIsNone) {
  RandomWorld world(1);
  int judged = 0;
  double mean = 0.0;
  for (int k = 0; k < 500; ++k) {
    const TurnMisfit misfit = FitTurn(Matches(world, 15, 0.0));
    EXPECT_EQ(misfit.freedom, 27.0);
    mean += misfit.squared / 500;
    judged += misfit.Evidence(6.0, 1.0) > 0.0 ? 1 : 0;
  }
  EXPECT_NEAR(mean, 27.0, 1.5);  // chi2
  EXPECT_LE(judged, 1);
}

TEST(Parallax, IsSeenBeyondTheNoise) {
  RandomWorld world(2);
  for (int k = 0; k < 100; ++k) {
    // A common shift is a turn; half of it differs from point to point.
    EXPECT_GT(FitTurn(Matches(world, 15, 12.0)).Evidence(6.0, 1.0), 0.0);
    EXPECT_EQ(FitTurn(Matches(world, 15, 60.0)).Evidence(6.0, 1.0), 1.0);
  }
}

TEST(Parallax, FewMatchesAreNotFitted) {
  TurnResidual one;
  one.residual = {20.0, 0.0};
  one.d_rotation.setZero();
  one.noise.setIdentity();
  const TurnMisfit misfit = FitTurn(std::vector{one});
  EXPECT_EQ(misfit.freedom, 2.0);
  EXPECT_EQ(misfit.squared, 400.0);
  EXPECT_EQ(misfit.Evidence(6.0, 1.0), 1.0);
  EXPECT_EQ(FitTurn({}).Evidence(6.0, 1.0), 0.0);
}

}  // namespace
}  // namespace saccade::parallax_test
