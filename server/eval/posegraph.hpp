#pragma once

#include <atomic>
#include <string>

#include "server/eval/g2o_file.hpp"

namespace saccade {

/// What `saccade-eval posegraph` makes least.
enum class PoseGraphCostKind {
  /// Sum of kappa |R_j - R_i R|^2 (Frobenius) + tau |t_j - t_i - R_i t|^2, each edge's information
  /// made into two numbers: tau = 3 / trace(translation block^-1), kappa = 3 / (2 trace(rotation
  /// block^-1)); in the plane 2 / trace and the third diagonal entry. That is SE-Sync's (Rosen et
  /// al., IJRR 2019), for which optima are proven.
  kChordal,
  /// Sum of error^T information error with the full matrices, as g2o counts it.
  kChi2,
};

struct PoseGraphResult {
  double chordal_before = 0.0, chordal_after = 0.0;
  double chi2_before = 0.0, chi2_after = 0.0;
  std::string start;  // of the file, along a tree, by relaxation: whichever cost least
  int iterations = 0;
  bool converged = false;
};

/// Moves the nodes of `file` to where the cost is least. `robust_width`: of Cauchy's loss [sigmas],
/// 0 for none.
PoseGraphResult SolvePoseGraph(G2oGraph& file, PoseGraphCostKind kind, double robust_width);

}  // namespace saccade
