#include <benchmark/benchmark.h>

#include <random>

#include "server/map/bundle_adjustment.hpp"

namespace saccade {
namespace {

/// Keyframes along 0.6 m, the first third held; points 1 to 4 m away, each seen by 30 keyframes in
/// a row; matches good to 0.3 px of a 500 px lens, poses and depths known as the filter knows them.
BundleProblem MakeProblem(int keyframes, int points) {
  std::mt19937_64 random(1);
  const auto noise = [&](double sigma) {
    std::normal_distribution<double> normal(0.0, sigma);
    return Eigen::Vector3d(normal(random), normal(random), normal(random));
  };
  constexpr double kSigma_rad = 0.3 / 500.0;
  BundleProblem problem;
  std::vector<Rigid3> truth;
  for (int k = 0; k < keyframes; ++k) {
    const double along = static_cast<double>(k) / keyframes;
    truth.push_back({ExpQuaternion({0.02 * along, -0.1 * along, 0.0}), {0.6 * along, 0.02, 0.0}});
    Rigid3 guess = truth.back();
    const bool fixed = 3 * k < keyframes;
    if (!fixed) guess.translation += noise(0.002);
    problem.keyframes.push_back({guess, fixed});
  }
  std::uniform_real_distribution<double> across(-0.5, 0.5), depth(1.0, 4.0);
  for (int k = 0; k < points; ++k) {
    const int first = k * (keyframes - 30) / points;
    const double z = depth(random);
    const Eigen::Vector3d in_anchor(z * across(random), z * across(random), z);
    const Eigen::Vector3d point = truth[first] * in_anchor;
    BundlePoint bundled;
    bundled.anchor = first;
    bundled.bearing = bundled.seen = (in_anchor.normalized() + noise(kSigma_rad)).normalized();
    bundled.seen_sigma_rad = kSigma_rad;
    bundled.inverse_range = 1.03 / in_anchor.norm();
    bundled.prior_inverse_range = bundled.prior_sigma = bundled.inverse_range;
    problem.points.push_back(bundled);
    for (int from = first + 1; from < first + 30; ++from) {
      const Eigen::Vector3d ray = (truth[from].Inverse() * point).normalized();
      problem.sightings.push_back({from, k, (ray + noise(kSigma_rad)).normalized(), kSigma_rad});
    }
  }
  return problem;
}

/// One adjustment: arguments are keyframes (a third of them held) and points.
void AdjustBundleOnce(benchmark::State& state) {
  const BundleProblem problem =
      MakeProblem(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  for (auto _ : state) {
    BundleProblem work = problem;
    if (!AdjustBundle(work, false)) state.SkipWithError("no solution");
  }
}
BENCHMARK(AdjustBundleOnce)->Args({40, 150})->Args({60, 300})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace saccade
