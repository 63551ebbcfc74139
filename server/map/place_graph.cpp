#include "server/map/place_graph.hpp"

#include <algorithm>
#include <cmath>

#include "server/map/pose_graph.hpp"

namespace saccade {
namespace {

// Drift of one step against the next, for a step as long as the distance to what is in view; it
// grows with the root of the length. What the figures are to one another says how an error is
// spread, no more.
constexpr double kStepShare = 0.06, kStepAngle_rad = 0.03, kStepLogScale = 0.15;
constexpr double kLeastStep = 0.01;  // of the distance: a turn on the spot drifts, too
constexpr double kRigid = 1e4;       // times the information of a step
constexpr double kFullyTied = 30.0;  // points that two keyframes share
constexpr double kLoopShare = 0.001, kLoopAngle_rad = 0.0005;
constexpr double kMostBent = 1.0;       // mean of squared errors of steps, in their sigmas
constexpr double kMostLoopLeft = 25.0;  // squared error of a degree of freedom that the loop keeps

PoseGraphEdge::Information Information(double position_m, double angle_rad, double log_scale) {
  PoseGraphEdge::Information information = PoseGraphEdge::Information::Zero();
  information.diagonal().head<3>().setConstant(1.0 / (position_m * position_m));
  information.diagonal().segment<3>(3).setConstant(4.0 / (angle_rad * angle_rad));
  information(6, 6) = 1.0 / (log_scale * log_scale);
  return information;
}

PoseGraphEdge Step(const KeyframeGraph::Outline& outline, int from, int to, double tie) {
  const auto &a = outline.keyframes[from], &b = outline.keyframes[to];
  PoseGraphEdge edge;
  edge.from = from;
  edge.to = to;
  edge.from_to = a.world_from_camera.Inverse() * b.world_from_camera;
  const double distance = std::max(1e-6, a.distance_m);
  const double length =
      std::sqrt(std::max(kLeastStep, edge.from_to.translation.norm() / distance +
                                         RotationAngle(a.world_from_camera, b.world_from_camera)));
  edge.information = tie * Information(kStepShare * length * distance, kStepAngle_rad * length,
                                       kStepLogScale * length);
  return edge;
}

PoseGraph MakeGraph(const KeyframeGraph::Outline& outline, int old_index, int new_index,
                    const Loop& loop) {
  PoseGraph graph;
  for (const auto& keyframe : outline.keyframes) {
    graph.nodes.push_back({keyframe.world_from_camera, 1.0, keyframe.sees_target});
  }
  graph.nodes.front().held = true;
  const auto rigid = [&](int k) {
    return outline.keyframes[k].id >= loop.rigid_from ? kRigid : 1.0;
  };
  for (int k = 0; k + 1 < std::ssize(graph.nodes); ++k) {
    graph.edges.push_back(Step(outline, k, k + 1, rigid(k)));
  }
  for (const auto& tie : outline.ties) {
    if (tie.to - tie.from < 2) continue;
    graph.edges.push_back(Step(outline, tie.from, tie.to,
                               rigid(tie.from) * 0.25 * std::min(1.0, tie.points / kFullyTied)));
  }
  PoseGraphEdge edge;
  edge.from = old_index;
  edge.to = new_index;
  edge.from_to = outline.keyframes[old_index].world_from_camera.Inverse() *
                 loop.old_from_new.Move(outline.keyframes[new_index].world_from_camera);
  edge.scale = loop.old_from_new.scale;
  edge.information =
      Information(kLoopShare * loop.distance_m, kLoopAngle_rad, loop.log_scale_sigma);
  graph.edges.push_back(edge);
  return graph;
}

}  // namespace

std::optional<MapCorrection> CloseLoop(const KeyframeGraph::Outline& outline, const Loop& loop,
                                       const std::atomic<bool>* stop) {
  const auto index = [&](KeyframeId id) {
    const auto at =
        std::lower_bound(outline.keyframes.begin(), outline.keyframes.end(), id,
                         [](const auto& keyframe, KeyframeId key) { return keyframe.id < key; });
    return at != outline.keyframes.end() && at->id == id
               ? static_cast<int>(at - outline.keyframes.begin())
               : -1;
  };
  const int old_index = index(loop.old_keyframe), new_index = index(loop.new_keyframe);
  if (old_index < 0 || new_index < 0 || old_index == new_index) return std::nullopt;
  PoseGraph graph = MakeGraph(outline, old_index, new_index, loop);
  const PoseGraphOptions options{.similarity = true, .max_iterations = 30, .tolerance = 1e-5};
  OptimisePoseGraph(graph, options, stop);
  if (stop != nullptr && *stop) return std::nullopt;
  PoseGraph only_loop{graph.nodes, {graph.edges.back()}};
  graph.edges.pop_back();
  if (!(PoseGraphCost(only_loop, options) < 7.0 * kMostLoopLeft) ||
      !(PoseGraphCost(graph, options) < kMostBent * static_cast<double>(graph.edges.size()))) {
    return std::nullopt;
  }
  MapCorrection correction;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const PoseGraphNode& node = graph.nodes[k];
    correction.of[outline.keyframes[k].id] =
        Similarity3::FromRigid(node.world_from_node, node.scale) *
        Similarity3::FromRigid(outline.keyframes[k].world_from_camera.Inverse());
  }
  const Similarity3 newest = correction.newest();
  for (auto& [id, moved] : correction.of) {
    if (id >= loop.rigid_from) moved = newest;
  }
  return correction;
}

}  // namespace saccade
