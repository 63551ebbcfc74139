#include "server/eval/posegraph.hpp"

#include <utility>

namespace saccade {
namespace {

/// `information` as the two numbers of the chordal cost: |R_j - R_i R|^2 is 8 times the square of
/// the quaternion's vector part.
PoseGraphEdge::Information Chordal(const PoseGraphEdge::Information& information, bool planar) {
  double tau = 0.0, kappa = 0.0;
  if (planar) {
    tau = 2.0 / information.topLeftCorner<2, 2>().inverse().trace();
    kappa = information(5, 5) / 4.0;  // of the angle; information is of half of it
  } else {
    tau = 3.0 / information.block<3, 3>(0, 0).inverse().trace();
    kappa = 3.0 / (2.0 * information.block<3, 3>(3, 3).inverse().trace());
  }
  PoseGraphEdge::Information isotropic = PoseGraphEdge::Information::Identity();
  isotropic.diagonal().head<3>().setConstant(tau);
  isotropic.diagonal().segment<3>(3).setConstant(8.0 * kappa);
  return isotropic;
}

}  // namespace

PoseGraphResult SolvePoseGraph(G2oGraph& file, PoseGraphCostKind kind, double robust_width) {
  PoseGraph chi2 = file.graph, chordal = file.graph;
  for (PoseGraphEdge& edge : chordal.edges) {
    edge.information = Chordal(edge.information, file.planar);
  }
  PoseGraphResult result;
  result.chordal_before = PoseGraphCost(chordal, {});
  result.chi2_before = PoseGraphCost(chi2, {});
  PoseGraph& graph = kind == PoseGraphCostKind::kChordal ? chordal : chi2;
  PoseGraphOptions options;
  options.robust_width = robust_width;
  PoseGraph by_tree = graph, relaxed = graph;
  StartByTree(by_tree, options);
  result.start = "the file's poses";
  double least = PoseGraphCost(graph, options);
  const auto offer = [&](PoseGraph& start, const char* name) {
    const double cost = PoseGraphCost(start, options);
    if (!(cost < least)) return;
    least = cost;
    graph.nodes = std::move(start.nodes);
    result.start = name;
  };
  offer(by_tree, "a spanning tree");
  if (StartByRelaxation(relaxed, options)) offer(relaxed, "chordal relaxation");
  const PoseGraphReport report = OptimisePoseGraph(graph, options);
  result.iterations = report.iterations;
  result.converged = report.converged;
  file.graph.nodes = chordal.nodes = chi2.nodes = std::vector<PoseGraphNode>(graph.nodes);
  result.chordal_after = PoseGraphCost(chordal, {});
  result.chi2_after = PoseGraphCost(chi2, {});
  return result;
}

}  // namespace saccade
