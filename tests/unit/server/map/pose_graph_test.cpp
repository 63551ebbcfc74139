#include "server/map/pose_graph.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace saccade::pose_graph_test {
namespace {

/// Poses on a helix, each tied to the next, and one turn to the next turn.
struct Helix {
  explicit Helix(int turns, bool similarity = false, std::uint64_t seed = 1) : random(seed) {
    constexpr int kAround = 20;
    for (int k = 0; k < kAround * turns; ++k) {
      const double angle = 2.0 * M_PI * k / kAround;
      PoseGraphNode node;
      node.world_from_node = {
          ExpQuaternion({0.0, 0.0, angle}) * ExpQuaternion({0.4 * std::sin(angle), 0.3, 0.0}),
          {5.0 * std::cos(angle), 5.0 * std::sin(angle), 0.05 * k}};
      if (similarity) node.scale = std::exp(0.02 * k);
      truth.push_back(node);
    }
    for (int k = 0; k + 1 < std::ssize(truth); ++k) Tie(k, k + 1);
    for (int k = 0; k + kAround < std::ssize(truth); k += 3) Tie(k, k + kAround);
    graph.nodes.resize(truth.size());
    graph.nodes.front() = truth.front();
  }

  void Tie(int from, int to, double noise = 0.0) {
    std::normal_distribution<double> normal;
    const auto draw = [&] {
      const double x = normal(random), y = normal(random), z = normal(random);
      return Eigen::Vector3d(x, y, z);
    };
    PoseGraphEdge edge;
    edge.from = from;
    edge.to = to;
    edge.from_to = truth[from].world_from_node.Inverse() * truth[to].world_from_node;
    edge.from_to.translation /= truth[from].scale;
    edge.scale = truth[to].scale / truth[from].scale;
    edge.from_to.translation += noise * draw();
    edge.from_to.rotation = edge.from_to.rotation * ExpQuaternion(noise * draw());
    graph.edges.push_back(edge);
  }

  double WorstDistance() const {
    double worst = 0.0;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      worst = std::max(
          worst, (graph.nodes[k].world_from_node.translation - truth[k].world_from_node.translation)
                     .norm());
    }
    return worst;
  }

  std::mt19937_64 random;
  std::vector<PoseGraphNode> truth;
  PoseGraph graph;
};

TEST(PoseGraph, RelaxationFindsTheTruthWhereNothingIsNoisy) {
  Helix helix(4);
  ASSERT_GT(helix.WorstDistance(), 1.0);
  ASSERT_TRUE(StartByRelaxation(helix.graph, {}));
  EXPECT_LT(helix.WorstDistance(), 1e-6);
  EXPECT_LT(PoseGraphCost(helix.graph, {}), 1e-12);
}

TEST(PoseGraph, ATreeFindsItToo) {
  Helix helix(4);
  StartByTree(helix.graph, {});
  EXPECT_LT(helix.WorstDistance(), 1e-6);
}

TEST(PoseGraph, DescendsToTheSameMinimumFromBothStarts) {
  Helix helix(5);
  helix.graph.edges.clear();
  for (int k = 0; k + 1 < std::ssize(helix.truth); ++k) helix.Tie(k, k + 1, 0.05);
  for (int k = 0; k + 20 < std::ssize(helix.truth); ++k) helix.Tie(k, k + 20, 0.05);
  PoseGraph by_tree = helix.graph, relaxed = helix.graph;
  StartByTree(by_tree, {});
  ASSERT_TRUE(StartByRelaxation(relaxed, {}));
  const PoseGraphReport one = OptimisePoseGraph(by_tree, {}), two = OptimisePoseGraph(relaxed, {});
  EXPECT_TRUE(one.converged && two.converged);
  EXPECT_LT(one.cost_after, 0.5 * one.cost_before);
  EXPECT_NEAR(one.cost_after, two.cost_after, 1e-6 * one.cost_after);
}

TEST(PoseGraph, ScalesThatDriftAreFoundAgain) {
  Helix helix(3, /*similarity=*/true);
  const PoseGraphOptions options{.similarity = true};
  PoseGraph relaxed = helix.graph;
  ASSERT_TRUE(StartByRelaxation(relaxed, options));
  EXPECT_NEAR(relaxed.nodes.back().scale, helix.truth.back().scale, 1e-6);
  // From a start that is off, by descent alone: the derivatives by scale are right.
  StartByTree(helix.graph, options);
  for (std::size_t k = 1; k < helix.graph.nodes.size(); ++k) {
    helix.graph.nodes[k].scale *= 1.0 + 0.2 * std::sin(static_cast<double>(k));
    helix.graph.nodes[k].world_from_node.translation.x() += 0.2 * std::cos(static_cast<double>(k));
  }
  const PoseGraphReport report = OptimisePoseGraph(helix.graph, options);
  EXPECT_LT(report.cost_after, 1e-12);
  EXPECT_LT(report.iterations, 15);
  EXPECT_LT(helix.WorstDistance(), 1e-4);
  EXPECT_NEAR(helix.graph.nodes.back().scale, helix.truth.back().scale, 1e-5);
}

TEST(PoseGraph, ARobustLossShrugsOffAFalseLoop) {
  Helix helix(4);
  PoseGraphEdge false_loop;
  false_loop.from = 3;
  false_loop.to = 71;
  StartByTree(helix.graph, {});  // as a walk ends: before the loop is closed
  for (PoseGraphEdge& edge : helix.graph.edges) edge.information *= 1e4;
  false_loop.information *= 1e4;
  helix.graph.edges.push_back(false_loop);
  PoseGraph squares = helix.graph;
  OptimisePoseGraph(squares, {});
  OptimisePoseGraph(helix.graph, {.robust_width = 2.0});
  EXPECT_LT(helix.WorstDistance(), 0.01);
  helix.graph.nodes = squares.nodes;
  EXPECT_GT(helix.WorstDistance(), 0.2);
}

TEST(PoseGraph, WhatIsHeldStaysAndEachPartKeepsItsFirstNode) {
  Helix helix(2);
  const std::size_t half = helix.truth.size();
  const PoseGraph single = helix.graph;
  for (PoseGraphEdge edge : single.edges) {  // the same graph again, tied to nothing
    edge.from += static_cast<int>(half);
    edge.to += static_cast<int>(half);
    helix.graph.edges.push_back(edge);
  }
  helix.graph.nodes.resize(2 * half);
  helix.graph.nodes[half].world_from_node.translation = {0.0, 0.0, 9.0};
  helix.graph.nodes[half + 5].held = true;
  helix.graph.nodes[half + 5].world_from_node = helix.truth[5].world_from_node;
  const std::vector<bool> held = HeldNodes(helix.graph);
  EXPECT_EQ(std::count(held.begin(), held.end(), true), 2);
  EXPECT_TRUE(held[0] && held[half + 5]);
  ASSERT_TRUE(StartByRelaxation(helix.graph, {}));
  EXPECT_LT(helix.WorstDistance(), 1e-6);
  EXPECT_LT((helix.graph.nodes[half].world_from_node.translation -
             helix.truth[0].world_from_node.translation)
                .norm(),
            1e-6);
}

TEST(PoseGraph, RepeatsToTheBit) {
  const auto run = [] {
    Helix helix(4);
    helix.graph.edges.clear();
    for (int k = 0; k + 1 < std::ssize(helix.truth); ++k) helix.Tie(k, k + 1, 0.02);
    for (int k = 0; k + 20 < std::ssize(helix.truth); ++k) helix.Tie(k, k + 20, 0.02);
    StartByRelaxation(helix.graph, {});
    return OptimisePoseGraph(helix.graph, {}).cost_after;
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace saccade::pose_graph_test
