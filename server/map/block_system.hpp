#pragma once

#include <Eigen/Dense>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace saccade {

/// Symmetric positive definite normal equations of a graph: one N x N block for each node and one
/// for each pair of nodes that a link ties. The pattern is laid out once and filled again and
/// again. Solved by sparse Cholesky (Eigen, minimum degree), or, where that would fill up (grids in
/// space), by conjugate gradients preconditioned with an incomplete one. One thread, repeats to the
/// bit.
template <int N>
class BlockSystem {
 public:
  using Block = Eigen::Matrix<double, N, N>;

  /// `links`: pairs of different nodes in [0, nodes); a pair may come more than once.
  BlockSystem(int nodes, std::span<const std::pair<int, int>> links) : below_(nodes) {
    for (const auto& [a, b] : links) below_[std::min(a, b)].push_back(std::max(a, b));
    std::vector<Eigen::Index> starts;
    Eigen::Index entries = 0;
    for (std::vector<int>& rows : below_) {
      std::sort(rows.begin(), rows.end());
      rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
      for (int k = 0; k < N; ++k) {
        starts.push_back(entries);
        entries += N - k + N * std::ssize(rows);
      }
    }
    starts.push_back(entries);
    matrix_.resize(N * nodes, N * nodes);
    matrix_.resizeNonZeros(entries);
    std::copy(starts.begin(), starts.end(), matrix_.outerIndexPtr());
    for (int node = 0; node < nodes; ++node) {
      for (int k = 0; k < N; ++k) LayOutColumn(node, k);
    }
    Clear();
    direct_.analyzePattern(matrix_);
    fills_up_ = direct_.Work() > kMostWork;
  }

  void Clear() { matrix_.coeffs().setZero(); }

  void AddNode(int node, const Block& block) {
    for (int k = 0; k < N; ++k) {
      double* column = matrix_.valuePtr() + matrix_.outerIndexPtr()[N * node + k];
      for (int row = k; row < N; ++row) column[row - k] += block(row, k);
    }
  }

  /// `block`: rows of `a`, columns of `b`; {a, b} must have been among the links.
  void AddLink(int a, int b, const Block& block) {
    const std::vector<int>& rows = below_[std::min(a, b)];
    const auto slot = std::lower_bound(rows.begin(), rows.end(), std::max(a, b)) - rows.begin();
    for (int k = 0; k < N; ++k) {
      double* column =
          matrix_.valuePtr() + matrix_.outerIndexPtr()[N * std::min(a, b) + k] + N - k + N * slot;
      for (int row = 0; row < N; ++row) column[row] += a > b ? block(row, k) : block(k, row);
    }
  }

  /// Of the matrix with its diagonal times 1 + `damping`. False: not positive definite.
  bool Factorise(double damping = 0.0) {
    const auto scale = [&](double factor) {
      for (Eigen::Index column = 0; column < matrix_.cols(); ++column) {
        matrix_.valuePtr()[matrix_.outerIndexPtr()[column]] *= factor;
      }
    };
    if (damping > 0.0) scale(1.0 + damping);
    bool done = false;
    if (fills_up_) {
      iterative_.setTolerance(kResidual);
      iterative_.setMaxIterations(kMostIterations);
      iterative_.compute(matrix_);
      done = iterative_.info() == Eigen::Success;
    } else {
      direct_.factorize(matrix_);
      done = direct_.info() == Eigen::Success;
      if (damping > 0.0) scale(1.0 / (1.0 + damping));
    }
    return done;
  }

  Eigen::MatrixXd Solve(const Eigen::MatrixXd& right) const {
    if (fills_up_) return iterative_.solve(right);
    return direct_.solve(right);
  }

 private:
  static constexpr double kMostWork = 1e10;  // multiplications of a Cholesky decomposition
  static constexpr double kResidual = 1e-5;  // of conjugate gradients, to the right side

  static constexpr int kMostIterations = 1000;

  using Matrix = Eigen::SparseMatrix<double>;
  struct Direct : Eigen::SimplicialLLT<Matrix> {
    /// Of one decomposition; known once the pattern is.
    double Work() const { return this->m_nonZerosPerCol.template cast<double>().squaredNorm(); }
  };
  using Iterative =
      Eigen::ConjugateGradient<Matrix, Eigen::Lower, Eigen::IncompleteCholesky<double>>;

  void LayOutColumn(int node, int k) {
    auto* at = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[N * node + k];
    for (int row = k; row < N; ++row) *at++ = N * node + row;
    for (const int other : below_[node]) {
      for (int row = 0; row < N; ++row) *at++ = N * other + row;
    }
  }

  std::vector<std::vector<int>> below_;  // of each node: those of higher number tied to it
  Matrix matrix_;                        // lower triangle
  Direct direct_;
  Iterative iterative_;
  bool fills_up_ = false;
};

}  // namespace saccade
