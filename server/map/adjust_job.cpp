// Adjustment of a part of the keyframe graph, and what it may not do to the rest.
#include "server/map/keyframe_graph.hpp"

namespace saccade {
namespace {

constexpr double kBentShare = 0.01;  // of its distance that an adjusted old keyframe is wrong by
constexpr double kBentAngle_rad = 0.01;

bool BendsTheOld(const KeyframeGraph::Job& before, const KeyframeGraph::Job& after) {
  for (std::size_t k = 0; k < before.first_recent; ++k) {
    const Rigid3& was = before.problem.keyframes[k].world_from_camera;
    const Rigid3& is = after.problem.keyframes[k].world_from_camera;
    if ((is.translation - was.translation).norm() > kBentShare * before.distances_m[k] ||
        RotationAngle(was, is) > kBentAngle_rad) {
      return true;
    }
  }
  return false;
}

}  // namespace

void KeyframeGraph::FindRecent(Job& job) const {
  job.first_recent = job.keyframes.size();
  for (auto in_graph = keyframes_.rbegin(); in_graph != keyframes_.rend() && job.first_recent > 0 &&
                                            job.keyframes[job.first_recent - 1] == in_graph->first;
       ++in_graph) {
    --job.first_recent;
  }
  for (const KeyframeId id : job.keyframes) {
    job.distances_m.push_back(keyframes_.at(id).distance_m);
  }
}

bool AdjustJob(KeyframeGraph::Job& job, const std::atomic<bool>& stop) {
  KeyframeGraph::Job held = job;
  if (!AdjustBundle(job.problem, stop)) return false;
  if (!BendsTheOld(held, job)) return true;
  for (std::size_t k = 0; k < held.first_recent; ++k) held.problem.keyframes[k].fixed = true;
  job = std::move(held);
  return AdjustBundle(job.problem, stop);
}

}  // namespace saccade
