#include "server/filter/covariance.hpp"

namespace saccade {

Eigen::MatrixXd Covariance::Block(int row, int col, int rows, int cols) const {
  Eigen::MatrixXd block(rows, cols);
  for (int c = 0; c < cols; ++c) {
    for (int r = 0; r < rows; ++r) block(r, c) = at(row + r, col + c);
  }
  return block;
}

void Covariance::CopyColumns(int col, int count, Eigen::Ref<Eigen::MatrixXd> out) const {
  for (int r = 0; r < col; ++r) {
    for (int c = 0; c < count; ++c) out(r, c) = p_(col + c, r);
  }
  for (int c = 0; c < count; ++c) {
    for (int r = 0; r < c; ++r) out(col + r, c) = p_(col + c, col + r);
    const int from = col + c;
    out.col(c).segment(from, n_ - from) = p_.col(from).segment(from, n_ - from);
  }
}

int Covariance::Append(int size) {
  const int offset = n_;
  const int needed = n_ + size;
  if (needed > p_.rows()) {
    // Odd leading dimension (in cache lines): rows of the lower triangle are read across columns.
    const int capacity = 2 * needed + (2 * needed % 16 == 0 ? 8 : 0);
    Eigen::MatrixXd bigger = Eigen::MatrixXd::Zero(capacity, capacity);
    bigger.topLeftCorner(n_, n_) = p_.topLeftCorner(n_, n_);
    p_.swap(bigger);
  }
  n_ = needed;
  p_.block(offset, 0, size, needed).setZero();
  return offset;
}

void Covariance::Append(const Covariance& other) {
  const int offset = Append(other.n_);
  p_.block(offset, offset, other.n_, other.n_) = other.p_.topLeftCorner(other.n_, other.n_);
}

void Covariance::Keep(const std::vector<int>& keep) {
  const int m = static_cast<int>(keep.size());
  for (int c = 0; c < m; ++c) {
    const int from = keep[c];
    for (int r = c; r < m; ++r) p_(r, c) = p_(keep[r], from);
  }
  n_ = m;
}

void Covariance::Downdate(const Eigen::Ref<const Eigen::MatrixXd>& w) {
  p_.topLeftCorner(n_, n_).selfadjointView<Eigen::Lower>().rankUpdate(w, -1.0);
}

void Covariance::TransformBlock(int offset, const Eigen::Ref<const Eigen::MatrixXd>& block) {
  const int size = static_cast<int>(block.rows());
  const Eigen::MatrixXd diagonal = Block(offset, offset, size, size);
  if (offset > 0) {
    const Eigen::MatrixXd left = block * p_.block(offset, 0, size, offset);
    p_.block(offset, 0, size, offset) = left;
  }
  const int below = n_ - offset - size;
  if (below > 0) {
    const Eigen::MatrixXd under = p_.block(offset + size, offset, below, size) * block.transpose();
    p_.block(offset + size, offset, below, size) = under;
  }
  p_.block(offset, offset, size, size) = block * diagonal * block.transpose();
}

void Covariance::TransformRankOne(const Eigen::VectorXd& d, const Eigen::VectorXd& w) {
  auto p = p_.topLeftCorner(n_, n_).selfadjointView<Eigen::Lower>();
  Eigen::VectorXd u = p * w;
  u += 0.5 * w.dot(u) * d;
  p.rankUpdate(d, u, 1.0);
}

void Covariance::Condition(const Eigen::MatrixXd& a, int offset) {
  const auto size = a.cols();
  Eigen::MatrixXd left(n_, 2 * size), right(n_, 2 * size);
  CopyColumns(offset, static_cast<int>(size), left.leftCols(size));
  const Eigen::MatrixXd own = left.middleRows(offset, size).leftCols(size);
  left.leftCols(size) -= 0.5 * a * own;
  left.rightCols(size) = a;
  right << a, left.leftCols(size);
  p_.topLeftCorner(n_, n_).triangularView<Eigen::Lower>() -= left * right.transpose();
}

void Covariance::ReplaceBlock(int offset, const Eigen::Ref<const Eigen::MatrixXd>& diagonal_block) {
  const int size = static_cast<int>(diagonal_block.rows());
  p_.block(offset, 0, size, offset).setZero();
  p_.block(offset, offset, n_ - offset, size).setZero();
  p_.block(offset, offset, size, size) = diagonal_block;
}

void Covariance::AddBlock(int offset, const Eigen::Ref<const Eigen::MatrixXd>& block) {
  p_.block(offset, offset, block.rows(), block.cols()) += block;
}

void Covariance::Assign(const Eigen::MatrixXd& full) {
  n_ = 0;
  Append(static_cast<int>(full.rows()));
  p_.topLeftCorner(n_, n_) = full;
}

Eigen::MatrixXd Covariance::Among(const std::vector<int>& rows) const {
  const auto size = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd block(size, size);
  for (Eigen::Index c = 0; c < size; ++c) {
    for (Eigen::Index r = 0; r < size; ++r) block(r, c) = at(rows[r], rows[c]);
  }
  return block;
}

void Covariance::Blend(const std::vector<int>& rows, const Eigen::MatrixXd& before,
                       const Eigen::MatrixXd& share) {
  for (Eigen::Index c = 0; c < before.cols(); ++c) {
    for (Eigen::Index r = 0; r < before.rows(); ++r) {
      if (rows[r] < rows[c] || share(r, c) <= 0.0) continue;
      double& number = p_(rows[r], rows[c]);
      number += share(r, c) * (before(r, c) - number);
    }
  }
}

}  // namespace saccade
