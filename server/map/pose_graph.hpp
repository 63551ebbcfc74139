#pragma once

#include <Eigen/Dense>
#include <atomic>
#include <vector>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A pose of the graph: p_world = scale * rotation * p_node + translation.
struct PoseGraphNode {
  Rigid3 world_from_node;
  double scale = 1.0;  // of lengths measured in this node; 1 where all lengths are metres
  bool held = false;   // not moved
};

/// What was measured between two nodes.
///
/// Errors, in this order: translation (rotation^T (R_i^T (t_j - t_i) / s_i - translation)), in
/// lengths of `from`; vector part of the quaternion of the rotation that is left over, w >= 0 (half
/// the rotation vector when small; 8 times its square is the chordal distance's); logarithm of
/// the ratio of scales. This is what g2o calls the error of EDGE_SE3:QUAT.
struct PoseGraphEdge {
  using Information = Eigen::Matrix<double, 7, 7>;
  int from = 0, to = 0;  // indices of nodes
  Rigid3 from_to;        // pose of `to` in `from`
  double scale = 1.0;    // s_to / s_from
  Information information = Information::Identity();
};

struct PoseGraph {
  std::vector<PoseGraphNode> nodes;
  std::vector<PoseGraphEdge> edges;
};

struct PoseGraphOptions {
  bool similarity = false;    // scales are unknown as well (Strasdat et al., RSS 2010)
  double robust_width = 0.0;  // Cauchy loss on edges, in sigmas; 0: squares
  int max_iterations = 100;
  double tolerance = 1e-7;  // stops when the cost falls by less than this share of it
};

struct PoseGraphReport {
  double cost_before = 0.0, cost_after = 0.0;
  int iterations = 0;
  bool converged = false;
};

/// Sum over edges of error^T information error, or of their loss.
double PoseGraphCost(const PoseGraph& graph, const PoseGraphOptions& options);

/// A start that does not depend on where the nodes are: scales and rotations by linear least
/// squares, rotations then projected (chordal relaxation: Martinec & Pajdla, CVPR 2007; Carlone et
/// al., ICRA 2015), then translations. Nodes that are held stay; of every connected part without
/// one the first node stays. False: the equations cannot be solved; `graph` is as it was.
bool StartByRelaxation(PoseGraph& graph, const PoseGraphOptions& options);

/// The same along a spanning tree, in order of the edges (breadth first): needs no equations.
void StartByTree(PoseGraph& graph, const PoseGraphOptions& options);

/// Moves the nodes to where the cost is least, from where they are (Levenberg-Marquardt on the
/// manifold, sparse Cholesky). Deterministic. `stop` ends it early, with the best so far.
PoseGraphReport OptimisePoseGraph(PoseGraph& graph, const PoseGraphOptions& options,
                                  const std::atomic<bool>* stop = nullptr);

/// Of every node whether it is held, or the first of a connected part in which none is: what
/// defines the gauge.
std::vector<bool> HeldNodes(const PoseGraph& graph);

}  // namespace saccade
