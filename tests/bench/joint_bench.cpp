// T35: two wearers in one filter, who share nothing, against two filters of one each. `ratio` is
// the median, over frames done one after the other in one run, of what the joint one took over what
// the two took together; at most 1.1. `coupled`: the same after one has seen a feature of the
// other's, when everything is correlated with everything.
#include <benchmark/benchmark.h>

#include <algorithm>

#include "tests/bench/bench.hpp"
#include "tests/bench/filter_run.hpp"

namespace saccade {
namespace {

using Stages = std::array<double, kFilterStages>;
constexpr FeatureId kOthers = 10'000;

FilterState Begun() {
  FilterState filter(FilterRun::Options(PointForm::kBearingRange));
  filter.Reset(CameraMotion(), FilterRun::StartCovariance());
  return filter;
}

double Timed(FilterRun& run, benchmark::State& state) {
  Stages ms{};
  if (const absl::Status status = run.Step(ms); !status.ok()) {
    state.SkipWithError(std::string(status.message()).c_str());
  }
  return ms[kAll];
}

/// The first sees one feature of the second's.
absl::Status Couple(FilterState& filter) {
  Observation seen;
  seen.id = kOthers;
  seen.noise = 100.0 * Eigen::Matrix2d::Identity();
  CameraIntrinsics lens;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = 457.0;
  lens.cx = 319.5;
  lens.cy = 239.5;
  const CameraModel camera(lens);
  const auto at = filter.Predicted(camera, seen.id);
  if (!at) return absl::InternalError("bench joint: the feature is not in view");
  seen.pixel = at->at.pixel;
  return filter.Update(camera, std::span(&seen, 1), filter.camera().world_from_camera).status();
}

void BM_TwoWearersInOneFilter(benchmark::State& state) {
  const int features = static_cast<int>(state.range(0));
  FilterState joint = Begun(), one = Begun(), other = Begun();
  const RobotId second =
      joint.AddRobot(CameraMotion(), FilterRun::StartCovariance(), {.readout_sigma_s = 0.015});
  FilterRun in_joint(features, joint), second_in_joint(features, joint, second, kOthers);
  FilterRun alone(features, one), second_alone(features, other, kFirstRobot, kOthers);
  for (FilterRun* run : {&in_joint, &second_in_joint, &alone, &second_alone}) {
    if (const absl::Status status = run->WarmUp(); !status.ok()) {
      state.SkipWithError(std::string(status.message()).c_str());
      return;
    }
  }
  if (state.range(1) != 0) {
    if (const absl::Status status = Couple(joint); !status.ok()) {
      state.SkipWithError(std::string(status.message()).c_str());
      return;
    }
  }
  std::vector<double> ratios;
  for (auto _ : state) {
    const double joint_ms = Timed(in_joint, state) + Timed(second_in_joint, state);
    ratios.push_back(joint_ms / (Timed(alone, state) + Timed(second_alone, state)));
    state.SetIterationTime(1e-3 * joint_ms);
  }
  const auto middle = ratios.begin() + std::ssize(ratios) / 2;
  std::nth_element(ratios.begin(), middle, ratios.end());
  state.counters["ratio"] = *middle;
}
BENCHMARK(BM_TwoWearersInOneFilter)
    ->ArgNames({"features", "coupled"})
    ->ArgsProduct({{50, 100}, {0, 1}})
    ->Iterations(300)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace saccade
