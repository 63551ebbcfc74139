#include "server/map/pose_graph.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/map/block_system.hpp"

namespace saccade {
namespace {

constexpr double kFirstDamping = 1e-6, kMostDamping = 1e8;
constexpr double kNothing = 1e-11;  // largest entry of a step that is none

using Vector7d = Eigen::Matrix<double, 7, 1>;

/// Error of an edge, and how it changes with steps of its ends: translation (world), rotation
/// (local, on the right), logarithm of scale.
struct Linearised {
  Vector7d error;
  PoseGraphEdge::Information by_from, by_to;
};

Eigen::Quaterniond Upper(const Eigen::Quaterniond& q) {
  return q.w() < 0 ? Eigen::Quaterniond(-q.coeffs()) : q;
}

Vector7d ErrorOf(const PoseGraph& graph, const PoseGraphEdge& edge) {
  const PoseGraphNode &from = graph.nodes[edge.from], &to = graph.nodes[edge.to];
  const Eigen::Quaterniond& measured = edge.from_to.rotation;
  const Eigen::Vector3d seen =
      from.world_from_node.rotation.conjugate() *
      ((to.world_from_node.translation - from.world_from_node.translation) / from.scale);
  const Eigen::Matrix3d measured_from = measured.toRotationMatrix().transpose();
  const Eigen::Quaterniond left =
      Upper(measured.conjugate() * from.world_from_node.rotation.conjugate() *
            to.world_from_node.rotation);
  Vector7d error;
  error.head<3>() = measured_from * (seen - edge.from_to.translation);
  error.segment<3>(3) = left.vec();
  error[6] = std::log(to.scale / (from.scale * edge.scale));
  return error;
}

Linearised Linearise(const PoseGraph& graph, const PoseGraphEdge& edge) {
  const PoseGraphNode &from = graph.nodes[edge.from], &to = graph.nodes[edge.to];
  Linearised all;
  all.error = ErrorOf(graph, edge);
  all.by_from.setZero();
  all.by_to.setZero();
  const Eigen::Matrix3d measured_from = edge.from_to.RotationMatrix().transpose();
  const Eigen::Matrix3d from_world = from.world_from_node.RotationMatrix().transpose();
  const Eigen::Vector3d seen =
      from_world * (to.world_from_node.translation - from.world_from_node.translation) / from.scale;
  all.by_to.block<3, 3>(0, 0) = measured_from * from_world / from.scale;
  all.by_from.block<3, 3>(0, 0) = -all.by_to.block<3, 3>(0, 0);
  all.by_from.block<3, 3>(0, 3) = measured_from * Skew(seen);
  all.by_from.block<3, 1>(0, 6) = -measured_from * seen;
  const Eigen::Quaterniond left =
      Upper(edge.from_to.rotation.conjugate() * from.world_from_node.rotation.conjugate() *
            to.world_from_node.rotation);
  const Eigen::Matrix3d w = left.w() * Eigen::Matrix3d::Identity();
  all.by_to.block<3, 3>(3, 3) = 0.5 * (w + Skew(left.vec()));
  all.by_from.block<3, 3>(3, 3) = -0.5 * (w - Skew(left.vec())) * measured_from;
  all.by_to(6, 6) = 1.0;
  all.by_from(6, 6) = -1.0;
  return all;
}

/// Cauchy's loss (Triggs et al. 2000) of a squared error, and the weight that it gives.
struct Loss {
  double cost = 0.0, weight = 1.0;
};
Loss LossOf(double squared, double width) {
  if (width <= 0.0) return {squared, 1.0};
  const double ratio = squared / (width * width);
  return {width * width * std::log1p(ratio), 1.0 / (1.0 + ratio)};
}

double SquaredError(const Vector7d& error, const PoseGraphEdge& edge, bool similarity) {
  const int n = similarity ? 7 : 6;
  return error.head(n).dot(edge.information.topLeftCorner(n, n) * error.head(n));
}

/// N = 6: poses; 7: similarities.
template <int N>
class Minimiser {
 public:
  Minimiser(PoseGraph& graph, const PoseGraphOptions& options, std::vector<int> unknown, int count)
      : graph_(graph),
        options_(options),
        unknown_(std::move(unknown)),
        system_(count, Links()),
        gradient_(N * count) {}

  PoseGraphReport Run(const std::atomic<bool>* stop) {
    PoseGraphReport report;
    double cost = report.cost_before = PoseGraphCost(graph_, options_);
    while (report.iterations < options_.max_iterations && !report.converged) {
      if (stop != nullptr && *stop) break;
      ++report.iterations;
      Fill();
      const double better = Descend(cost, stop);
      report.converged = cost - better <= options_.tolerance * cost;
      cost = better;
    }
    report.cost_after = cost;
    return report;
  }

 private:
  std::vector<std::pair<int, int>> Links() const {
    std::vector<std::pair<int, int>> links;
    for (const PoseGraphEdge& edge : graph_.edges) {
      const int from = unknown_[edge.from], to = unknown_[edge.to];
      if (from >= 0 && to >= 0) links.emplace_back(from, to);
    }
    return links;
  }

  void Fill() {
    system_.Clear();
    gradient_.setZero();
    for (const PoseGraphEdge& edge : graph_.edges) {
      const int from = unknown_[edge.from], to = unknown_[edge.to];
      if (from < 0 && to < 0) continue;
      const Linearised all = Linearise(graph_, edge);
      const double weight =
          LossOf(SquaredError(all.error, edge, N == 7), options_.robust_width).weight;
      const Eigen::Matrix<double, N, N> information =
          weight * edge.information.template topLeftCorner<N, N>();
      const Eigen::Matrix<double, N, N> by_from = all.by_from.template topLeftCorner<N, N>();
      const Eigen::Matrix<double, N, N> by_to = all.by_to.template topLeftCorner<N, N>();
      const Eigen::Matrix<double, N, 1> weighted = information * all.error.template head<N>();
      if (from >= 0) {
        system_.AddNode(from, by_from.transpose() * information * by_from);
        gradient_.template segment<N>(N * from) += by_from.transpose() * weighted;
      }
      if (to >= 0) {
        system_.AddNode(to, by_to.transpose() * information * by_to);
        gradient_.template segment<N>(N * to) += by_to.transpose() * weighted;
      }
      if (from >= 0 && to >= 0) {
        system_.AddLink(from, to, by_from.transpose() * information * by_to);
      }
    }
  }

  /// One step down, damped until there is one. The cost then; the same if there is none.
  double Descend(double cost, const std::atomic<bool>* stop) {
    const std::vector<PoseGraphNode> before = graph_.nodes;
    for (; damping_ <= kMostDamping; damping_ = std::max(kFirstDamping, 10.0 * damping_)) {
      if (stop != nullptr && *stop) return cost;
      if (!system_.Factorise(damping_)) continue;
      const Eigen::VectorXd step = -system_.Solve(gradient_);
      if (!step.allFinite()) continue;
      Move(step);
      const double now = PoseGraphCost(graph_, options_);
      if (now < cost) {
        damping_ = damping_ > kFirstDamping ? 0.1 * damping_ : 0.0;
        return now;
      }
      graph_.nodes = before;
      if (step.lpNorm<Eigen::Infinity>() < kNothing) break;
    }
    return cost;
  }

  void Move(const Eigen::VectorXd& step) {
    for (std::size_t k = 0; k < graph_.nodes.size(); ++k) {
      if (unknown_[k] < 0) continue;
      const auto by = step.template segment<N>(N * unknown_[k]);
      Rigid3& pose = graph_.nodes[k].world_from_node;
      pose.translation += by.template head<3>();
      pose.rotation = (pose.rotation * ExpQuaternion(by.template segment<3>(3))).normalized();
      if constexpr (N == 7) graph_.nodes[k].scale *= std::exp(by[6]);
    }
  }

  PoseGraph& graph_;
  const PoseGraphOptions& options_;
  std::vector<int> unknown_;  // of each node; -1: held
  BlockSystem<N> system_;
  Eigen::VectorXd gradient_;
  double damping_ = 0.0;
};

}  // namespace

double PoseGraphCost(const PoseGraph& graph, const PoseGraphOptions& options) {
  double cost = 0.0;
  for (const PoseGraphEdge& edge : graph.edges) {
    const double squared = SquaredError(ErrorOf(graph, edge), edge, options.similarity);
    cost += LossOf(squared, options.robust_width).cost;
  }
  return cost;
}

std::vector<bool> HeldNodes(const PoseGraph& graph) {
  std::vector<int> part(graph.nodes.size());  // union by smallest number
  std::iota(part.begin(), part.end(), 0);
  const auto root = [&](int k) {
    while (part[k] != k) k = part[k] = part[part[k]];
    return k;
  };
  for (const PoseGraphEdge& edge : graph.edges) {
    const int a = root(edge.from), b = root(edge.to);
    part[std::max(a, b)] = std::min(a, b);
  }
  std::vector<bool> held(graph.nodes.size()), has(graph.nodes.size());
  for (std::size_t k = 0; k < held.size(); ++k) {
    held[k] = graph.nodes[k].held;
    if (held[k]) has[root(static_cast<int>(k))] = true;
  }
  for (std::size_t k = 0; k < held.size(); ++k) {
    const auto first = static_cast<std::size_t>(root(static_cast<int>(k)));
    if (!has[first]) held[first] = has[first] = true;
  }
  return held;
}

PoseGraphReport OptimisePoseGraph(PoseGraph& graph, const PoseGraphOptions& options,
                                  const std::atomic<bool>* stop) {
  const std::vector<bool> held = HeldNodes(graph);
  std::vector<int> unknown(graph.nodes.size(), -1);
  int count = 0;
  for (std::size_t k = 0; k < held.size(); ++k) {
    if (!held[k]) unknown[k] = count++;
  }
  if (count == 0) {
    const double cost = PoseGraphCost(graph, options);
    return {cost, cost, 0, true};
  }
  if (options.similarity) return Minimiser<7>(graph, options, std::move(unknown), count).Run(stop);
  return Minimiser<6>(graph, options, std::move(unknown), count).Run(stop);
}

}  // namespace saccade
