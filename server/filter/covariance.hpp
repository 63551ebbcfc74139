#pragma once

#include <Eigen/Dense>
#include <vector>

namespace saccade {

/// Joint covariance of a filter. Only the lower triangle of the leading n x n block is valid: the
/// rank update then costs half, and nobody can make it asymmetric (architecture, section 7).
class Covariance {
 public:
  int dim() const { return n_; }
  double at(int row, int col) const { return row >= col ? p_(row, col) : p_(col, row); }
  double& lower(int row, int col) { return p_(row, col); }

  /// rows x cols block with its corner at (row, col), which may cross the diagonal.
  Eigen::MatrixXd Block(int row, int col, int rows, int cols) const;
  Eigen::MatrixXd Full() const { return p_.topLeftCorner(n_, n_).selfadjointView<Eigen::Lower>(); }

  /// `count` full columns from `col` into `out` (n x count).
  void CopyColumns(int col, int count, Eigen::Ref<Eigen::MatrixXd> out) const;

  /// Appends `size` rows and columns of zeros; returns their offset.
  int Append(int size);
  /// Appends all of another, which shares nothing with this one.
  void Append(const Covariance& other);
  /// Keeps these rows and columns (rising), drops the others.
  void Keep(const std::vector<int>& keep);
  /// P <- P - W W^T with W n x m.
  void Downdate(const Eigen::Ref<const Eigen::MatrixXd>& w);
  /// P <- T P T^T where T is the identity but for the square `block` on the diagonal at `offset`.
  void TransformBlock(int offset, const Eigen::Ref<const Eigen::MatrixXd>& block);
  /// P <- T P T^T with T = I + d w^T (both n).
  void TransformRankOne(const Eigen::VectorXd& d, const Eigen::VectorXd& w);
  /// P <- (I - A E) P (I - A E)^T where E picks the rows [offset, offset + A.cols()).
  void Condition(const Eigen::MatrixXd& a, int offset);
  /// Zeroes rows and columns [offset, offset + size) and puts `diagonal_block` there.
  void ReplaceBlock(int offset, const Eigen::Ref<const Eigen::MatrixXd>& diagonal_block);
  /// The block that these rows (any order) share.
  Eigen::MatrixXd Among(const std::vector<int>& rows) const;
  /// That block <- share * before + (1 - share) * itself, number by number.
  void Blend(const std::vector<int>& rows, const Eigen::MatrixXd& before,
             const Eigen::MatrixXd& share);
  /// Adds a symmetric block on the diagonal at `offset`.
  void AddBlock(int offset, const Eigen::Ref<const Eigen::MatrixXd>& block);
  void Clear() { n_ = 0; }
  /// Replaces everything; only the lower triangle of `full` is read.
  void Assign(const Eigen::MatrixXd& full);

 private:
  int n_ = 0;
  Eigen::MatrixXd p_;
};

}  // namespace saccade
