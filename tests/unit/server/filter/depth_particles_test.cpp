#include "server/filter/depth_particles.hpp"

#include <gtest/gtest.h>

#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::depth_particles_test {
namespace {

constexpr double kNoise_px = 1.0;
constexpr double kFrame_s = 1.0 / 30.0;
constexpr double kPosition_m = 0.001,
                 kRotation_rad = 0.0005;  // how well the camera's pose is known

/// One feature, seen by a camera that moves on with a constant speed.
struct Life {
  DepthVerdict verdict = DepthVerdict::kPartial;
  double range_m = 0, truth_m = 0, sigma_m = 0;
  double inverse_error_in_sigma = 0;
  int frames = 0;
};

class Simulator {
 public:
  explicit Simulator(std::uint64_t seed) : world_(seed), lens_(TestCamera()) {}

  Life Run(double truth_m, const Eigen::Vector3d& velocity, double clutter = 0.0) {
    const Eigen::Vector2d pixel(world_.Uniform(120, 520), world_.Uniform(120, 360));
    const Eigen::Vector3d place = truth_m * *lens_.Unproject(pixel);
    Eigen::Matrix<double, 3, 2> d_bearing;
    DepthLine line;
    line.line.bearing = *lens_.Unproject(pixel + world_.NormalVector<2>(kNoise_px), &d_bearing);
    line.line.basis = TangentBasis(line.line.bearing);
    const Eigen::Matrix2d tangent = line.line.basis.transpose() * d_bearing;
    line.covariance.bottomRightCorner<2, 2>() =
        kNoise_px * kNoise_px * tangent * tangent.transpose();
    line.covariance.block<3, 3>(0, 0).diagonal().setConstant(kPosition_m * kPosition_m);
    line.covariance.block<3, 3>(3, 3).diagonal().setConstant(kRotation_rad * kRotation_rad);
    DepthParticles particles{DepthParticleOptions()};
    Life life;
    life.truth_m = truth_m;
    while (life.verdict == DepthVerdict::kPartial && life.frames < 100) {
      ++life.frames;
      const Rigid3 truth{ExpQuaternion(Eigen::Vector3d(0.002, -0.003, 0.004) * life.frames),
                         life.frames * kFrame_s * velocity};
      line.world_from_camera = {
          truth.rotation * ExpQuaternion(world_.NormalVector<3>(kRotation_rad)),
          truth.translation + world_.NormalVector<3>(kPosition_m)};
      particles.Predict(lens_, line, kNoise_px * kNoise_px * Eigen::Matrix2d::Identity());
      life.verdict = particles.Update(Search(particles, truth, place, clutter));
    }
    life.range_m = particles.range_m();
    life.sigma_m = particles.range_sigma_m();
    life.inverse_error_in_sigma =
        (particles.inverse_range() - 1.0 / truth_m) / particles.inverse_range_sigma();
    return life;
  }

  RandomWorld& world() { return world_; }

 private:
  /// The patch is found where it is, in every ellipse that holds it; with `clutter`, sometimes at
  /// something that looks alike.
  std::vector<std::optional<Eigen::Vector2d>> Search(const DepthParticles& particles,
                                                     const Rigid3& truth,
                                                     const Eigen::Vector3d& place, double clutter) {
    std::vector<std::optional<Eigen::Vector2d>> matches(particles.particles().size());
    const auto seen = lens_.Project(truth.Inverse() * place);
    if (!seen) return matches;
    Eigen::Vector2d at = *seen + world_.NormalVector<2>(kNoise_px);
    if (world_.Uniform(0, 1) < clutter) at += world_.NormalVector<2>(15.0);
    for (std::size_t k = 0; k < matches.size(); ++k) {
      const DepthParticle& particle = particles.particles()[k];
      if (!particle.pixel) continue;
      const Eigen::Vector2d off = at - *particle.pixel;
      if (off.dot(particle.covariance.inverse() * off) < 9.0) matches[k] = at;
    }
    return matches;
  }

  RandomWorld world_;
  CameraModel lens_;
};

Eigen::Vector3d SidewaysVelocity(RandomWorld& world) {
  const double angle = world.Uniform(0, 2 * M_PI);
  return world.Uniform(0.25, 0.6) *
         Eigen::Vector3d(std::cos(angle), std::sin(angle), world.Uniform(-0.3, 0.3)).normalized();
}

TEST(DepthParticles, DepthAtConversionIsWithinThreeSigmaT12) {
  Simulator sim(12);
  int known = 0, outside = 0, frames = 0, outside_inverse = 0;
  double relative = 0.0;
  constexpr int kFeatures = 1000;
  for (int k = 0; k < kFeatures; ++k) {
    const double truth = sim.world().Uniform(0.6, 4.5);
    const Life life = sim.Run(truth, SidewaysVelocity(sim.world()));
    if (life.verdict != DepthVerdict::kKnown) continue;
    ++known;
    frames += life.frames;
    outside += std::abs(life.range_m - life.truth_m) > 3.0 * life.sigma_m ? 1 : 0;
    outside_inverse += std::abs(life.inverse_error_in_sigma) > 3.0 ? 1 : 0;
    relative += life.sigma_m / life.range_m;
  }
  std::printf(
      "T12: %d of %d features became known after %.1f frames, %.0f %% sigma; %d beyond 3 sigma "
      "(as inverse range %d)\n",
      known, kFeatures, static_cast<double>(frames) / known, 100 * relative / known, outside,
      outside_inverse);
  EXPECT_GE(known, kFeatures / 2);
  EXPECT_LE(outside, 0.03 * known);
  EXPECT_LE(outside_inverse, 0.03 * known);
}

// Without a baseline the noise at birth, the same in every frame, passes for depth: so no attempt.
TEST(DepthParticles, ACameraThatHardlyMovesGivesNoAttempt) {
  const DepthParticles particles{DepthParticleOptions()};
  EXPECT_FALSE(particles.WorthAttempt({0.1, 0.1, 0.1}));
  EXPECT_TRUE(particles.WorthAttempt({0.1, 0.2, 0.1}));
}

TEST(DepthParticles, BeyondTheLineItIsGone) {
  Simulator sim(14);
  int known = 0;
  for (int k = 0; k < 100; ++k) {
    known += sim.Run(0.2, {0.4, 0, 0}).verdict == DepthVerdict::kKnown ? 1 : 0;
  }
  EXPECT_EQ(known, 0);
}

TEST(DepthParticles, LookAlikesCostFeaturesRatherThanTruth) {
  Simulator sim(15);
  int known = 0, wrong = 0;
  for (int k = 0; k < 300; ++k) {
    const Life life =
        sim.Run(sim.world().Uniform(0.8, 4.0), SidewaysVelocity(sim.world()), /*clutter=*/0.1);
    if (life.verdict != DepthVerdict::kKnown) continue;
    ++known;
    wrong += std::abs(life.range_m - life.truth_m) > 3.0 * life.sigma_m ? 1 : 0;
  }
  std::printf("with 10 %% false matches: %d of 300 became known, %d of them wrong\n", known, wrong);
  EXPECT_GE(known, 50);
  EXPECT_LE(wrong, 0.1 * known);
}

TEST(DepthParticles, NoMatchAnywhereEndsIt) {
  DepthParticles particles{DepthParticleOptions()};
  DepthLine line;
  line.line.basis = TangentBasis(line.line.bearing);
  particles.Predict(TestCamera(), line, Eigen::Matrix2d::Identity());
  const std::vector<std::optional<Eigen::Vector2d>> none(particles.particles().size());
  EXPECT_EQ(particles.Update(none), DepthVerdict::kGone);
}

TEST(DepthParticles, OutOfViewIsNoAttempt) {
  DepthParticles particles{DepthParticleOptions()};
  DepthLine line;
  line.line.basis = TangentBasis(line.line.bearing);
  line.world_from_camera.rotation = ExpQuaternion({0, M_PI, 0});
  particles.Predict(TestCamera(), line, Eigen::Matrix2d::Identity());
  const std::vector<std::optional<Eigen::Vector2d>> none(particles.particles().size());
  EXPECT_EQ(particles.Update(none), DepthVerdict::kPartial);
  EXPECT_EQ(particles.attempts(), 0);
}

TEST(DepthParticles, BeginsUniformAndRefusesBadOptions) {
  const DepthParticles particles{DepthParticleOptions()};
  EXPECT_NEAR(particles.range_m(), 2.75, 1e-9);
  EXPECT_NEAR(particles.range_sigma_m(), 4.5 / std::sqrt(12.0), 1e-9);
  EXPECT_TRUE(DepthParticleOptions().Validate().ok());
  EXPECT_FALSE(DepthParticleOptions{.count = 1}.Validate().ok());
  EXPECT_FALSE(DepthParticleOptions{.min_range_m = 0}.Validate().ok());
  EXPECT_FALSE(DepthParticleOptions{.max_range_m = 0.4}.Validate().ok());
  EXPECT_FALSE(DepthParticleOptions{.fewest = 100}.Validate().ok());
  EXPECT_FALSE((DepthParticleOptions{.known_below = -1}.Validate().ok()));
}

}  // namespace
}  // namespace saccade::depth_particles_test
