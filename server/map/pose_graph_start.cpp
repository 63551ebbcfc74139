// Where the optimiser of a pose graph starts from.
#include <algorithm>
#include <cmath>
#include <deque>

#include "server/map/block_system.hpp"
#include "server/map/pose_graph.hpp"

namespace saccade {
namespace {

/// One number for a block of information: that of the mean variance.
double Weight(const Eigen::Matrix3d& information) { return 3.0 / information.inverse().trace(); }

/// Least squares of the kind sum w |x_to - A x_from - c|^2, a node's x of N rows and `Columns`
/// columns, known where nodes are held.
template <int N, int Columns>
class LinearGraph {
 public:
  using Part = Eigen::Matrix<double, N, Columns>;

  LinearGraph(const PoseGraph& graph, const std::vector<bool>& held)
      : unknown_(Number(held)),
        count_(static_cast<int>(std::count(held.begin(), held.end(), false))),
        system_(count_, Links(graph)),
        right_(Eigen::MatrixXd::Zero(N * count_, Columns)) {}

  /// `known`: the part of a node that is held.
  template <typename Known>
  void Add(const PoseGraphEdge& edge, double weight, const Eigen::Matrix<double, N, N>& a,
           const Part& c, const Known& known) {
    const int from = unknown_[edge.from], to = unknown_[edge.to];
    Part rest = c;  // x_to - A x_from = rest
    if (from < 0) rest += a * known(edge.from);
    if (to < 0) rest -= known(edge.to);
    if (to >= 0) {
      system_.AddNode(to, weight * Eigen::Matrix<double, N, N>::Identity());
      right_.template middleRows<N>(N * to) += weight * rest;
    }
    if (from >= 0) {
      system_.AddNode(from, weight * a.transpose() * a);
      right_.template middleRows<N>(N * from) -= weight * a.transpose() * rest;
    }
    if (from >= 0 && to >= 0) system_.AddLink(to, from, -weight * a);
  }

  bool Solve() {
    if (count_ == 0) return true;
    if (!system_.Factorise()) return false;
    right_ = system_.Solve(right_);
    return right_.allFinite();
  }
  bool Held(std::size_t node) const { return unknown_[node] < 0; }
  Part Found(std::size_t node) const { return right_.template middleRows<N>(N * unknown_[node]); }

 private:
  static std::vector<int> Number(const std::vector<bool>& held) {
    std::vector<int> numbers(held.size(), -1);
    int next = 0;
    for (std::size_t k = 0; k < held.size(); ++k) {
      if (!held[k]) numbers[k] = next++;
    }
    return numbers;
  }
  std::vector<std::pair<int, int>> Links(const PoseGraph& graph) const {
    std::vector<std::pair<int, int>> links;
    for (const PoseGraphEdge& edge : graph.edges) {
      const int from = unknown_[edge.from], to = unknown_[edge.to];
      if (from >= 0 && to >= 0) links.emplace_back(from, to);
    }
    return links;
  }

  std::vector<int> unknown_;  // of each node; -1: held
  int count_ = 0;
  BlockSystem<N> system_;
  Eigen::MatrixXd right_;
};

using Matrix1d = Eigen::Matrix<double, 1, 1>;

bool RelaxScales(PoseGraph& graph, const std::vector<bool>& held) {
  LinearGraph<1, 1> linear(graph, held);
  const auto known = [&](int node) { return Matrix1d(std::log(graph.nodes[node].scale)); };
  for (const PoseGraphEdge& edge : graph.edges) {
    linear.Add(edge, edge.information(6, 6), Matrix1d::Identity(), Matrix1d(std::log(edge.scale)),
               known);
  }
  if (!linear.Solve()) return false;
  for (std::size_t k = 0; k < held.size(); ++k) {
    if (!linear.Held(k)) graph.nodes[k].scale = std::exp(linear.Found(k)(0, 0));
  }
  return true;
}

Eigen::Quaterniond NearestRotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return Eigen::Quaterniond(svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose())
      .normalized();
}

/// R_to = R_from R_measured holds for each row by itself: unknowns are the transposed matrices.
bool RelaxRotations(PoseGraph& graph, const std::vector<bool>& held) {
  LinearGraph<3, 3> linear(graph, held);
  const auto known = [&](int node) -> Eigen::Matrix3d {
    return graph.nodes[node].world_from_node.RotationMatrix().transpose();
  };
  for (const PoseGraphEdge& edge : graph.edges) {
    linear.Add(edge, Weight(edge.information.block<3, 3>(3, 3)),
               edge.from_to.RotationMatrix().transpose(), Eigen::Matrix3d::Zero(), known);
  }
  if (!linear.Solve()) return false;
  for (std::size_t k = 0; k < held.size(); ++k) {
    if (linear.Held(k)) continue;
    graph.nodes[k].world_from_node.rotation = NearestRotation(linear.Found(k).transpose());
  }
  return true;
}

/// Rotations and scales are known: t_to - t_from = s_from R_from t_measured, each axis by itself.
bool SolveTranslations(PoseGraph& graph, const std::vector<bool>& held) {
  LinearGraph<1, 3> linear(graph, held);
  const auto known = [&](int node) -> Eigen::RowVector3d {
    return graph.nodes[node].world_from_node.translation.transpose();
  };
  for (const PoseGraphEdge& edge : graph.edges) {
    const PoseGraphNode& from = graph.nodes[edge.from];
    const Eigen::RowVector3d way =
        (from.scale * (from.world_from_node.rotation * edge.from_to.translation)).transpose();
    linear.Add(edge, Weight(edge.information.block<3, 3>(0, 0)) / (from.scale * from.scale),
               Matrix1d::Identity(), way, known);
  }
  if (!linear.Solve()) return false;
  for (std::size_t k = 0; k < held.size(); ++k) {
    if (linear.Held(k)) continue;
    graph.nodes[k].world_from_node.translation = linear.Found(k).transpose();
  }
  return true;
}

PoseGraphNode Ahead(const PoseGraphNode& from, const PoseGraphEdge& edge) {
  const Rigid3& pose = from.world_from_node;
  return {{(pose.rotation * edge.from_to.rotation).normalized(),
           pose.translation + from.scale * (pose.rotation * edge.from_to.translation)},
          from.scale * edge.scale,
          false};
}

PoseGraphNode Back(const PoseGraphNode& to, const PoseGraphEdge& edge) {
  PoseGraphNode from;
  from.scale = to.scale / edge.scale;
  Rigid3& pose = from.world_from_node;
  pose.rotation = (to.world_from_node.rotation * edge.from_to.rotation.conjugate()).normalized();
  pose.translation =
      to.world_from_node.translation - from.scale * (pose.rotation * edge.from_to.translation);
  return from;
}

}  // namespace

bool StartByRelaxation(PoseGraph& graph, const PoseGraphOptions& options) {
  const std::vector<bool> held = HeldNodes(graph);
  PoseGraph start = graph;
  if (options.similarity && !RelaxScales(start, held)) return false;
  if (!RelaxRotations(start, held) || !SolveTranslations(start, held)) return false;
  graph.nodes = std::move(start.nodes);
  return true;
}

void StartByTree(PoseGraph& graph, const PoseGraphOptions& options) {
  std::vector<std::vector<int>> edges_of(graph.nodes.size());
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    edges_of[graph.edges[k].from].push_back(static_cast<int>(k));
    edges_of[graph.edges[k].to].push_back(static_cast<int>(k));
  }
  std::vector<bool> placed = HeldNodes(graph);
  std::deque<int> queue;
  for (std::size_t k = 0; k < placed.size(); ++k) {
    if (placed[k]) queue.push_back(static_cast<int>(k));
  }
  for (; !queue.empty(); queue.pop_front()) {
    const int here = queue.front();
    for (const int e : edges_of[here]) {
      const PoseGraphEdge& edge = graph.edges[e];
      const int other = edge.from == here ? edge.to : edge.from;
      if (placed[other]) continue;
      const double scale = graph.nodes[other].scale;
      graph.nodes[other] =
          edge.from == here ? Ahead(graph.nodes[here], edge) : Back(graph.nodes[here], edge);
      if (!options.similarity) graph.nodes[other].scale = scale;
      placed[other] = true;
      queue.push_back(other);
    }
  }
}

}  // namespace saccade
