#include <absl/strings/str_format.h>

#include <iostream>

#include "server/eval/commands.hpp"
#include "server/eval/posegraph.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

absl::Status PoseGraphCommand(const PoseGraphArguments& arguments) {
  absl::StatusOr<G2oGraph> graph = LoadG2o(arguments.in);
  if (!graph.ok()) return graph.status();
  const bool chordal = arguments.cost == "chordal";
  const Timestamp begin = MonotonicNow();
  const PoseGraphResult result =
      SolvePoseGraph(*graph, chordal ? PoseGraphCostKind::kChordal : PoseGraphCostKind::kChi2,
                     arguments.robust_width);
  const double took_s = Seconds(MonotonicNow() - begin);
  if (const absl::Status saved = SaveG2o(arguments.out, *graph); !saved.ok()) return saved;
  std::cout << absl::StrFormat(
      "%d vertices, %d edges; start: %s; minimised: %s\n"
      "cost %s before %.6g after %.6g\n"
      "cost %s before %.6g after %.6g\n"
      "iterations %d (%s), %.2f s\n"
      "chordal: sum of kappa |Rj - Ri R|^2 + tau |tj - ti - Ri t|^2, tau and kappa from each "
      "edge's "
      "information as in SE-Sync\n"
      "chi2: sum of error^T information error, error = (translation, vector part of the "
      "quaternion) "
      "as in g2o\n",
      graph->graph.nodes.size(), graph->graph.edges.size(), result.start, arguments.cost, "chordal",
      result.chordal_before, result.chordal_after, "chi2", result.chi2_before, result.chi2_after,
      result.iterations, result.converged ? "converged" : "not converged", took_s);
  return absl::OkStatus();
}

}  // namespace saccade
