// What a thousand strokes add to one frame: on the tracker's thread, in the wearer's picture, for
// one subscriber. `strokes:0` and `strokes:1000` of one run are to be compared.
#include <benchmark/benchmark.h>

#include <map>
#include <memory>

#include "server/overlay/overlay.hpp"
#include "server/rpc/deltas.hpp"
#include "tests/unit/server/anchors/rig.hpp"

namespace saccade {
namespace {

constexpr std::size_t kPoints = 240;  // AnchorOptions: 240 000 points in 1000 annotations

/// A room whose map has so many features, with so many strokes on its walls.
struct Scene {
  Scene(int strokes, int features) : rig(Options(features)) {
    for (int i = 0; i < 3; ++i) rig.Show(Pose(i));
    for (int i = 0; i < strokes; ++i) {
      if (!rig.Draw(kPoints, i < 700 ? "a" : "b").ok()) std::abort();
    }
    for (int i = 0; i < 60; ++i) rig.Show(Pose(i));
  }
  static testing::SyntheticMap::Options Options(int features) {
    testing::SyntheticMap::Options options;
    options.features = features;
    return options;
  }
  static Rigid3 Pose(int i) {
    return testing::LookFrom({0.002 * (i % 10), 0, 0}, 0.002 * (i % 7), 0.2);
  }
  testing::Rig rig;
};

Scene& TheScene(const benchmark::State& state) {
  static std::map<std::pair<std::int64_t, std::int64_t>, std::unique_ptr<Scene>> scenes;
  std::unique_ptr<Scene>& scene = scenes[{state.range(0), state.range(1)}];
  if (!scene) {
    scene =
        std::make_unique<Scene>(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  }
  return *scene;
}

void BM_AnchorsOfOneFrame(benchmark::State& state) {
  Scene& scene = TheScene(state);
  int i = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const auto snapshot = scene.rig.map.Snapshot(Scene::Pose(++i));
    state.ResumeTiming();
    scene.rig.manager.Resolve(snapshot, *scene.rig.map.camera());
  }
}
BENCHMARK(BM_AnchorsOfOneFrame)
    ->ArgNames({"strokes", "features"})
    ->ArgsProduct({{0, 1, 1000}, {260, 3000}})
    ->Unit(benchmark::kMillisecond);

void BM_WearersPicture(benchmark::State& state) {
  Scene& scene = TheScene(state);
  const auto snapshot = scene.rig.map.Snapshot(Scene::Pose(1));
  scene.rig.manager.Resolve(snapshot, *scene.rig.map.camera());
  Frame frame;
  frame.camera = scene.rig.map.camera();
  frame.grey = cv::Mat(frame.camera->height(), frame.camera->width(), CV_8UC1, cv::Scalar(90));
  const auto annotations = scene.rig.manager.Latest();
  for (auto _ : state) {
    benchmark::DoNotOptimize(Augment(frame, *snapshot, *annotations, OverlayOptions()));
  }
}
BENCHMARK(BM_WearersPicture)
    ->ArgNames({"strokes", "features"})
    ->ArgsProduct({{0, 1000}, {260}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace saccade
