#include "server/team/team_filter.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <set>

namespace saccade {
namespace {

bool IsFinite(const BlockState& state) {
  return (!state.pose ||
          (state.pose->translation.allFinite() && state.pose->rotation.coeffs().allFinite())) &&
         state.numbers.allFinite();
}

}  // namespace

absl::Status TeamFilter::NoBlock(BlockId id) {
  return absl::InvalidArgumentError(absl::StrCat("there is no block ", id, "; it may have left"));
}

absl::Status TeamFilter::CheckNew(const std::string& name, const BlockState& state,
                                  const Eigen::MatrixXd& covariance) const {
  if (name.empty() || Find(name)) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", name, "' is taken or empty; give each block a name of its own"));
  }
  if (!IsFinite(state)) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": its state is not finite"));
  }
  const int n = state.dim();
  if (n == 0 || covariance.rows() != n || covariance.cols() != n || !covariance.allFinite() ||
      !covariance.isApprox(covariance.transpose(), 1e-9) || covariance.diagonal().minCoeff() < 0) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": its covariance must be ", n, " x ", n,
                                                   ", finite, symmetric and not negative"));
  }
  return absl::OkStatus();
}

absl::StatusOr<BlockId> TeamFilter::Add(const std::string& name, TeamBlockKind kind,
                                        const BlockState& state,
                                        const Eigen::MatrixXd& covariance) {
  if (absl::Status valid = CheckNew(name, state, covariance); !valid.ok()) return valid;
  blocks_.emplace(next_, Block{name, kind, state, covariance});
  return next_++;
}

absl::StatusOr<BlockId> TeamFilter::Derive(const std::string& name, TeamBlockKind kind,
                                           const BlockState& state,
                                           std::span<const BlockJacobian> from,
                                           const Eigen::MatrixXd& noise) {
  const int n = state.dim();
  if (absl::Status valid = CheckNew(name, state, noise); !valid.ok()) return valid;
  std::vector<BlockId> parents;
  for (const BlockJacobian& each : from) {
    if (!Has(each.block)) return NoBlock(each.block);
    if (each.jacobian.rows() != n || each.jacobian.cols() != this->state(each.block).dim() ||
        !each.jacobian.allFinite() ||
        std::find(parents.begin(), parents.end(), each.block) != parents.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, ": the Jacobian for ", blocks_.at(each.block).name,
                       " must be given once, finite, ", n, " x ", this->state(each.block).dim()));
    }
    parents.push_back(each.block);
  }
  Block block{name, kind, state, noise};
  std::map<BlockId, Eigen::MatrixXd> with;  // the new block's errors with the others'
  for (const BlockId other : Connected(parents)) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, blocks_.at(other).state.dim());
    for (const BlockJacobian& each : from) {
      if (each.block == other) {
        sum += each.jacobian * covariance(other);
      } else if (Share(each.block, other)) {
        sum += each.jacobian * Cross(each.block, other);
      }
    }
    with.emplace(other, std::move(sum));
  }
  for (const BlockJacobian& each : from) {
    block.covariance += with.at(each.block) * each.jacobian.transpose();
  }
  block.covariance = (0.5 * (block.covariance + block.covariance.transpose())).eval();
  const BlockId id = next_++;
  blocks_.emplace(id, std::move(block));
  for (const auto& [other, sum] : with) cross_.emplace(Pair(other, id), sum.transpose());
  return id;
}

absl::Status TeamFilter::Remove(BlockId id) {
  if (blocks_.erase(id) == 0) return absl::NotFoundError(absl::StrCat("there is no block ", id));
  std::erase_if(
      cross_, [&](const auto& each) { return each.first.first == id || each.first.second == id; });
  return absl::OkStatus();
}

absl::Status TeamFilter::Predict(BlockId id, const BlockState& state,
                                 const Eigen::MatrixXd& transition, const Eigen::MatrixXd& noise) {
  if (!Has(id)) return NoBlock(id);
  Block& block = blocks_.at(id);
  const int n = block.state.dim();
  if (state.dim() != n || state.pose.has_value() != block.state.pose.has_value() ||
      transition.rows() != n || transition.cols() != n || noise.rows() != n || noise.cols() != n ||
      !IsFinite(state) || !transition.allFinite() || !noise.allFinite()) {
    return absl::InvalidArgumentError(absl::StrCat(
        block.name, ": state, transition and noise must be finite and of ", n, " numbers a side"));
  }
  block.state = state;
  const Eigen::MatrixXd moved = transition * block.covariance * transition.transpose() + noise;
  block.covariance = 0.5 * (moved + moved.transpose());
  for (auto& [pair, cross] : cross_) {
    if (pair.first == id) cross = (transition * cross).eval();
    if (pair.second == id) cross = (cross * transition.transpose()).eval();
  }
  return absl::OkStatus();
}

std::optional<BlockId> TeamFilter::Find(const std::string& name) const {
  for (const auto& [id, block] : blocks_) {
    if (block.name == name) return id;
  }
  return std::nullopt;
}

const Eigen::MatrixXd* TeamFilter::CrossOf(BlockId a, BlockId b) const {
  const auto found = cross_.find(Pair(std::min(a, b), std::max(a, b)));
  return found == cross_.end() ? nullptr : &found->second;
}

Eigen::MatrixXd TeamFilter::Cross(BlockId a, BlockId b) const {
  const Eigen::MatrixXd* cross = CrossOf(a, b);
  if (cross == nullptr) return Eigen::MatrixXd::Zero(state(a).dim(), state(b).dim());
  return a < b ? *cross : Eigen::MatrixXd(cross->transpose());
}

std::vector<BlockId> TeamFilter::Connected(std::span<const BlockId> blocks) const {
  std::set<BlockId> all(blocks.begin(), blocks.end());
  for (const auto& [pair, cross] : cross_) {
    for (const BlockId id : blocks) {
      if (pair.first == id) all.insert(pair.second);
      if (pair.second == id) all.insert(pair.first);
    }
  }
  return {all.begin(), all.end()};
}

Eigen::MatrixXd TeamFilter::Among(std::span<const BlockId> blocks) const {
  int n = 0;
  for (const BlockId id : blocks) n += state(id).dim();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, n);
  int row = 0;
  for (const BlockId a : blocks) {
    int column = 0;
    for (const BlockId b : blocks) {
      const int rows = state(a).dim(), columns = state(b).dim();
      if (a == b) {
        all.block(row, column, rows, columns) = covariance(a);
      } else if (Share(a, b)) {
        all.block(row, column, rows, columns) = Cross(a, b);
      }
      column += columns;
    }
    row += state(a).dim();
  }
  return all;
}

std::vector<BlockId> TeamFilter::blocks() const {
  std::vector<BlockId> ids;
  for (const auto& [id, block] : blocks_) ids.push_back(id);
  return ids;
}

Eigen::MatrixXd TeamFilter::FullCovariance() const { return Among(blocks()); }

}  // namespace saccade
