// The part of StartFinder that turns a solution into what filter and keyframe graph take.
#include <algorithm>
#include <cmath>

#include "server/tracker/start_finder.hpp"

namespace saccade {
namespace {

/// A point nearer to infinity, or behind it, is left out; of the median inverse range.
constexpr double kLeastRangeShare = 0.02;

bool Usable(const StartPoint& point, const FoundStart& start) {
  return point.inverse_range > kLeastRangeShare * start.inverse_range;
}

double MedianInverseRange(const StartProblem& found) {
  std::vector<double> all;
  for (const StartPoint& point : found.points) all.push_back(point.inverse_range);
  std::nth_element(all.begin(), all.begin() + std::ssize(all) / 2, all.end());
  return all[all.size() / 2];
}

/// Rows of the solution's covariance that the filter wants, in its order.
std::vector<int> RowsOf(const StartProblem& found, const FoundStart& start) {
  std::vector<int> rows = {0};
  const auto take = [&rows](int from, int count) {
    for (int r = 0; r < count; ++r) rows.push_back(from + r);
  };
  const int keyframes = static_cast<int>(found.world_from_camera.size());
  for (int k = 0; k < keyframes; ++k) {
    if (start.keyframes[static_cast<std::size_t>(k)].anchor >= 0) take(1 + 6 * k, 6);
  }
  for (std::size_t p = 0; p < found.points.size(); ++p) {
    if (Usable(found.points[p], start)) take(1 + 6 * keyframes + 3 * static_cast<int>(p), 3);
  }
  return rows;
}

}  // namespace

FoundStart::Keyframe StartFinder::ReadKeyframe(std::size_t k, const StartSolution& solution,
                                               FoundStart& start) const {
  const StartProblem& found = solution.problem;
  FoundStart::Keyframe keyframe;
  keyframe.time_ns = shots_[job_.shots[k]].time_ns;
  keyframe.world_from_camera = found.world_from_camera[k];
  for (const Seen& seen : shots_[job_.shots[k]].sightings) {
    keyframe.sightings.push_back(
        {seen.id, seen.ray.At(found.readout_s), seen.ray.sigma_rad, std::nullopt});
  }
  const auto first_point = 1 + 6 * std::ssize(found.world_from_camera);
  for (std::size_t p = 0; p < found.points.size(); ++p) {
    const StartPoint& point = found.points[p];
    if (point.anchor != static_cast<int>(k) || !Usable(point, start)) continue;
    if (keyframe.anchor < 0) {
      keyframe.anchor = static_cast<int>(start.seed.clones.size());
      start.seed.clones.push_back(keyframe.world_from_camera);
    }
    const Eigen::Index range = first_point + 3 * static_cast<Eigen::Index>(p) + 2;
    const double sigma = std::sqrt(std::max(0.0, solution.covariance(range, range)));
    keyframe.births.push_back({job_.points[p], point.seen.At(found.readout_s), point.seen.sigma_rad,
                               point.inverse_range, sigma});
    const double variance = point.seen.sigma_rad * point.seen.sigma_rad;
    start.seed.features.push_back({job_.points[p], keyframe.anchor, point.bearing,
                                   variance * Eigen::Matrix2d::Identity(), point.inverse_range});
  }
  return keyframe;
}

FoundStart StartFinder::Read(const StartSolution& solution) const {
  const StartProblem& found = solution.problem;
  FoundStart start;
  start.evidence = solution.evidence;
  start.seed.readout_s = found.readout_s;
  start.inverse_range = MedianInverseRange(found);
  for (std::size_t k = 0; k < job_.shots.size(); ++k) {
    start.keyframes.push_back(ReadKeyframe(k, solution, start));
  }
  const std::vector<int> rows = RowsOf(found, start);
  start.seed.covariance = solution.covariance(rows, rows);
  const Shot& last = shots_[job_.shots.back()];
  const std::size_t before = job_.shots.size() - 2;
  start.newest = found.world_from_camera.back();
  start.newest_before = last.world_from_camera;
  start.newest_time_ns = last.time_ns;
  start.velocity =
      (start.newest.translation - start.keyframes[before].world_from_camera.translation) /
      Seconds(last.time_ns - shots_[job_.shots[before]].time_ns);
  return start;
}

}  // namespace saccade
