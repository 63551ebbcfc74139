#include "server/eval/scale_windows.hpp"

#include <algorithm>

namespace saccade {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMinPoses = 10;

double ScaleOf(const std::vector<PosePair>& pairs, std::size_t begin, std::size_t end) {
  std::vector<Vector3d> estimate, truth;
  for (std::size_t i = begin; i < end; ++i) {
    estimate.push_back(pairs[i].estimate.translation);
    truth.push_back(pairs[i].truth.translation);
  }
  return AlignPoints(estimate, truth, TrajectoryAlignment::kSim3).scale;
}

}  // namespace

std::optional<ScaleWindows> ScaleOfWindows(const std::vector<PosePair>& tracked) {
  if (tracked.size() < kMinPoses) return std::nullopt;
  const double whole = ScaleOf(tracked, 0, tracked.size());
  std::vector<double> path = {0};  // true path from the first pose to each
  for (std::size_t i = 1; i < tracked.size(); ++i) {
    path.push_back(path.back() +
                   (tracked[i].truth.translation - tracked[i - 1].truth.translation).norm());
  }
  std::optional<ScaleWindows> result;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < tracked.size(); ++begin) {
    const Timestamp until = tracked[begin].time_ns + kScaleWindow_ns;
    while (end < tracked.size() && tracked[end].time_ns <= until) ++end;
    if (end == tracked.size() && tracked.back().time_ns < until) break;  // the run ends before
    if (end - begin < kMinPoses || path[end - 1] - path[begin] < kScaleWindowPath_m) continue;
    const double ratio = ScaleOf(tracked, begin, end) / whole;
    if (!result) result = {ratio, ratio, 0};
    result->min = std::min(result->min, ratio);
    result->max = std::max(result->max, ratio);
    ++result->windows;
  }
  return result;
}

}  // namespace saccade
