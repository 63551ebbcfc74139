#include <benchmark/benchmark.h>

#include "server/features/corner_detector.hpp"
#include "server/features/image_pyramid.hpp"
#include "server/features/patch.hpp"
#include "server/features/search.hpp"
#include "tests/bench/textured_scene.hpp"

namespace saccade {
namespace {

using Scene = TexturedScene;

void BM_ImagePyramid(benchmark::State& state) {
  const Scene& scene = TheScene();
  ImagePyramid pyramid;
  for (auto _ : state) {
    benchmark::DoNotOptimize(pyramid.Build(scene.image).ok());
  }
}
BENCHMARK(BM_ImagePyramid)->Unit(benchmark::kMicrosecond);

void BM_DetectWholePicture(benchmark::State& state) {
  const Scene& scene = TheScene();
  CornerDetector detector({.level = static_cast<int>(state.range(0))});
  std::vector<Corner> corners;
  for (auto _ : state) {
    detector.DetectAll(scene.pyramid, {}, 100, corners);
    benchmark::DoNotOptimize(corners.data());
  }
  state.counters["corners"] = static_cast<double>(corners.size());
}
BENCHMARK(BM_DetectWholePicture)->ArgName("level")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

void BM_DetectOneBand(benchmark::State& state) {
  const Scene& scene = TheScene();
  CornerDetector detector({.level = static_cast<int>(state.range(0))});
  std::vector<Corner> corners;
  for (auto _ : state) {
    detector.DetectNextBand(scene.pyramid, {}, 10, corners);
    benchmark::DoNotOptimize(corners.data());
  }
}
BENCHMARK(BM_DetectOneBand)->ArgName("level")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

WarpStatus Warp(const Scene& scene, std::size_t k, bool coarse, WarpedPatch& warped) {
  const Rigid3 current_from_birth{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d(0, 0, 1))), {0.02, 0.0, 0.01}};
  const PatchTemplate& patch = scene.patches[k];
  const auto pixel = scene.camera->Project(current_from_birth * (patch.birth_bearing / 0.7));
  if (!pixel) return WarpStatus::kNotInView;
  return WarpPatch(patch, current_from_birth, patch.birth_bearing, 0.7, Eigen::Vector3d::Zero(),
                   *scene.camera, *pixel, {.coarse = coarse}, warped);
}

void BM_Warp100Patches(benchmark::State& state) {
  const Scene& scene = TheScene();
  WarpedPatch warped;
  for (auto _ : state) {
    for (std::size_t k = 0; k < scene.patches.size(); ++k) {
      benchmark::DoNotOptimize(Warp(scene, k, state.range(0) != 0, warped));
    }
  }
  state.counters["patches"] = static_cast<double>(scene.patches.size());
}
BENCHMARK(BM_Warp100Patches)->ArgName("coarse")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

/// `diameter`: of the ellipse [px]; templates 11 x 11, predictions 2 px off.
void Search100(benchmark::State& state, int coarse_above, SubPixel sub_pixel) {
  const Scene& scene = TheScene();
  std::vector<WarpedPatch> warped(scene.patches.size());
  for (std::size_t k = 0; k < warped.size(); ++k) {
    benchmark::DoNotOptimize(CopyPatch(scene.patches[k], {}, warped[k]));
  }
  SearchOptions options;
  options.coarse_above_pixels = coarse_above;
  options.sub_pixel = sub_pixel;
  PatchSearcher searcher(options);
  const double sigma = static_cast<double>(state.range(0)) / 6.0;
  const Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() * sigma * sigma;
  int found = 0;
  for (auto _ : state) {
    found = 0;
    for (std::size_t k = 0; k < warped.size(); ++k) {
      const Eigen::Vector2d predicted = scene.corners[k].pixel + Eigen::Vector2d(1.6, -1.2);
      found += searcher.Find(scene.pyramid, warped[k], predicted, covariance).found() ? 1 : 0;
    }
  }
  state.counters["found"] = found;
}
void BM_Search100(benchmark::State& state) { Search100(state, 250, SubPixel::kLucasKanade); }
void BM_Search100Exhaustive(benchmark::State& state) {
  Search100(state, 1 << 30, SubPixel::kLucasKanade);
}
void BM_Search100Parabola(benchmark::State& state) { Search100(state, 250, SubPixel::kParabola); }
BENCHMARK(BM_Search100)
    ->ArgName("diameter")
    ->Arg(6)
    ->Arg(12)
    ->Arg(20)
    ->Arg(30)
    ->Arg(55)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_Search100Exhaustive)
    ->ArgName("diameter")
    ->Arg(20)
    ->Arg(30)
    ->Arg(55)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_Search100Parabola)
    ->ArgName("diameter")
    ->Arg(6)
    ->Arg(20)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace saccade
