#include "server/eval/posegraph.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace saccade::posegraph_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::filesystem::path kGraphs =
    std::filesystem::path(SACCADE_SOURCE_DIR) / "../shared/data/posegraphs";

class G2o : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& text) const {
    const std::filesystem::path file = folder_ / "graph.g2o";
    std::ofstream(file) << text;
    return file;
  }
  std::string Refusal(const std::string& text) const {
    const auto graph = LoadG2o(Write(text));
    return graph.ok() ? "accepted" : std::string(graph.status().message());
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("saccade-posegraph-" + std::to_string(::getpid()));
};

constexpr char kInformation[] = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";

std::string Pair(const std::string& edge_tail) {
  return "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 7 1 0 0 0 0 0 1\n" + edge_tail;
}

TEST_F(G2o, WhatIsWrongIsSaidWithFileLineAndRemedy) {
  const std::string edge = "EDGE_SE3:QUAT 0 7 1 0 0 0 0 0 1 ";
  EXPECT_THAT(Refusal(Pair(edge + "1 0 0\n")),
              AllOf(HasSubstr("graph.g2o:3: "), HasSubstr("cut short"), HasSubstr("write `")));
  EXPECT_THAT(Refusal(Pair("")), HasSubstr("without an edge"));
  EXPECT_THAT(Refusal(""), HasSubstr("without an edge"));
  EXPECT_THAT(Refusal(Pair("EDGE_SE3:QUAT 0 7 nan 0 0 0 0 0 1 " + std::string(kInformation))),
              AllOf(HasSubstr(":3: "), HasSubstr("`nan`, is not a finite number")));
  EXPECT_THAT(Refusal(Pair("EDGE_SE3:QUAT 0 9 1 0 0 0 0 0 1 " + std::string(kInformation))),
              AllOf(HasSubstr(":3: "), HasSubstr("vertex 9 is not in the file")));
  EXPECT_THAT(Refusal(Pair("EDGE_SE3:QUAT 7 7 1 0 0 0 0 0 1 " + std::string(kInformation))),
              HasSubstr("to itself"));
  EXPECT_THAT(Refusal(Pair("EDGE_SE3:QUAT 0 7 1 0 0 0 0 0 0 " + std::string(kInformation))),
              HasSubstr("quaternion has length 0"));
  EXPECT_THAT(Refusal(Pair(edge + "-" + kInformation)), HasSubstr("not positive definite"));
  EXPECT_THAT(Refusal(Pair("VERTEX_SE3:QUAT 7 1 0 0 0 0 0 1\n")), HasSubstr("there twice"));
  EXPECT_THAT(Refusal(Pair("VERTEX_SE2 8 1 0 0\n")), HasSubstr("mixed"));
  EXPECT_THAT(Refusal(Pair("VERTEX_SE3:QUAT x 1 0 0 0 0 0 1\n")), HasSubstr("number of a vertex"));
  EXPECT_THAT(Refusal(Pair("EDGE_XYZ 1 2\n")), HasSubstr("`EDGE_XYZ` is not known"));
  EXPECT_THAT(Refusal(Pair(edge + kInformation + "\nFIX 3\n")), HasSubstr(":4: vertex 3"));
  EXPECT_EQ(LoadG2o(folder_ / "none.g2o").status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(LoadG2o(folder_).ok());
}

TEST_F(G2o, IsWrittenAsItWasRead) {
  const std::string text = Pair(
      "FIX 7\n"
      "EDGE_SE3:QUAT 0 7 1 0.5 0 0 0 0.6 0.8 "
      "2 0.1 0 0 0 0 3 0 0 0 0.2 4 0 0 0 5 0 0 6 0.3 7\n");
  const auto graph = LoadG2o(Write(text));
  ASSERT_TRUE(graph.ok()) << graph.status();
  const std::filesystem::path again = folder_ / "again.g2o";
  ASSERT_TRUE(SaveG2o(again, *graph).ok());
  std::ifstream file(again);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), text);
  EXPECT_TRUE(graph->graph.nodes[1].held);
  EXPECT_EQ(graph->ids, (std::vector<std::int64_t>{0, 7}));
}

/// A square of four poses in the plane; the last edge says that the way round is longer by 0.4.
TEST_F(G2o, APlaneStaysOne) {
  constexpr char kSquare[] =
      "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\nVERTEX_SE2 2 0 0 0\nVERTEX_SE2 3 0 0 0\n"
      "EDGE_SE2 0 1 1 0 1.5707963268 1 0 0 1 0 100\n"
      "EDGE_SE2 1 2 1 0 1.5707963268 1 0 0 1 0 100\n"
      "EDGE_SE2 2 3 1 0 1.5707963268 1 0 0 1 0 100\n"
      "EDGE_SE2 3 0 1.4 0 1.5707963268 1 0 0 1 0 100\n";
  auto graph = LoadG2o(Write(kSquare));
  ASSERT_TRUE(graph.ok()) << graph.status();
  const PoseGraphResult result = SolvePoseGraph(*graph, PoseGraphCostKind::kChi2, 0.0);
  EXPECT_TRUE(result.converged);
  // Each of the four gives 0.1 of the 0.4, along or across; turns give next to nothing.
  EXPECT_NEAR(result.chi2_after, 4 * 0.1 * 0.1, 2e-4);
  for (const PoseGraphNode& node : graph->graph.nodes) {
    EXPECT_NEAR(node.world_from_node.translation.z(), 0.0, 1e-12);
    EXPECT_NEAR(node.world_from_node.rotation.x(), 0.0, 1e-12);
  }
  ASSERT_TRUE(SaveG2o(folder_ / "out.g2o", *graph).ok());
  const auto again = LoadG2o(folder_ / "out.g2o");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->planar);
  EXPECT_NEAR(again->graph.edges[0].information(5, 5), 400.0, 1e-6);
}

/// Optima proven by SE-Sync (Rosen et al. 2019, table 1), from the raw files.
class KnownOptimum : public ::testing::TestWithParam<std::pair<const char*, double>> {};

TEST_P(KnownOptimum, IsReached) {
  const auto& [name, optimum] = GetParam();
  const std::filesystem::path file = kGraphs / name;
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no ../shared/data/posegraphs/" << name;
  auto graph = LoadG2o(file);
  ASSERT_TRUE(graph.ok()) << graph.status();
  const PoseGraphResult result = SolvePoseGraph(*graph, PoseGraphCostKind::kChordal, 0.0);
  EXPECT_GT(result.chordal_before, 100.0 * optimum);
  EXPECT_LE(result.chordal_after, 1.01 * optimum);
  EXPECT_GE(result.chordal_after, 0.999 * optimum);  // a lower one would be another cost
}

INSTANTIATE_TEST_SUITE_P(SeSync, KnownOptimum,
                         ::testing::Values(std::pair{"sphere2500.g2o", 1687.0},
                                           std::pair{"parking-garage.g2o", 1.263}),
                         [](const auto& graph) {
                           return std::string(graph.param.first).substr(0, 6);
                         });

}  // namespace
}  // namespace saccade::posegraph_test
