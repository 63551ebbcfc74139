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

absl::Status NoBlock(BlockId id) {
  return absl::InvalidArgumentError(absl::StrCat("there is no block ", id, "; it may have left"));
}

}  // namespace

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

absl::StatusOr<BlockId> TeamFilter::Add(const std::string& name, BlockKind kind,
                                        const BlockState& state,
                                        const Eigen::MatrixXd& covariance) {
  if (absl::Status valid = CheckNew(name, state, covariance); !valid.ok()) return valid;
  blocks_.emplace(next_, Block{name, kind, state, covariance});
  return next_++;
}

absl::StatusOr<BlockId> TeamFilter::Derive(const std::string& name, BlockKind kind,
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

absl::StatusOr<ObservationModel> TeamFilter::Ask(std::span<const BlockId> blocks,
                                                 const Expectation& expectation,
                                                 const std::vector<BlockState>& at,
                                                 const Eigen::MatrixXd& noise) const {
  std::vector<const BlockState*> states;
  for (const BlockState& each : at) states.push_back(&each);
  std::optional<ObservationModel> model = expectation(states);
  if (!model) return absl::OutOfRangeError("cannot be seen from where things are");
  const auto rows = model->residual.size();
  bool fits = rows > 0 && model->jacobians.size() == blocks.size() && noise.rows() == rows &&
              noise.cols() == rows;
  for (std::size_t k = 0; fits && k < blocks.size(); ++k) {
    fits = model->jacobians[k].rows() == rows && model->jacobians[k].cols() == at[k].dim();
  }
  if (!fits) return absl::InvalidArgumentError("residual, Jacobians and noise do not fit together");
  return *std::move(model);
}

absl::StatusOr<BlockUpdate> TeamFilter::Update(std::span<const BlockId> blocks,
                                               const Expectation& expectation,
                                               const Eigen::MatrixXd& noise,
                                               const UpdateOptions& options) {
  std::vector<BlockState> start;
  for (const BlockId id : blocks) {
    if (!Has(id)) return NoBlock(id);
    if (std::count(blocks.begin(), blocks.end(), id) > 1) {
      return absl::InvalidArgumentError(absl::StrCat(name(id), " is named twice"));
    }
    start.push_back(state(id));
  }
  const Eigen::MatrixXd prior = Among(blocks);
  Eigen::VectorXd error = Eigen::VectorXd::Zero(prior.rows());
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd solved;  // S^-1 innovation
  Eigen::LLT<Eigen::MatrixXd> factor;
  BlockUpdate update;
  for (int k = 0; k < std::max(1, options.iterations); ++k) {
    std::vector<BlockState> at;
    int column = 0;
    for (const BlockState& each : start) {
      at.push_back(Moved(each, error.segment(column, each.dim())));
      column += each.dim();
    }
    const absl::StatusOr<ObservationModel> model = Ask(blocks, expectation, at, noise);
    if (!model.ok()) return model.status();
    jacobian.resize(model->residual.size(), prior.rows());
    column = 0;
    for (const Eigen::MatrixXd& each : model->jacobians) {
      jacobian.middleCols(column, each.cols()) = each;
      column += static_cast<int>(each.cols());
    }
    const Eigen::VectorXd innovation = model->residual + jacobian * error;
    const Eigen::MatrixXd spread = jacobian * prior * jacobian.transpose();
    if (k == 0) {
      factor.compute(spread + noise);
      if (factor.info() != Eigen::Success || !innovation.allFinite()) break;
      update.distance2 = innovation.dot(factor.solve(innovation));
      if (options.student_dof > 0) {
        update.weight = (options.student_dof + static_cast<double>(innovation.size())) /
                        (options.student_dof + update.distance2);
        update.weight = std::min(1.0, update.weight);
      }
    }
    factor.compute(spread + noise / update.weight);
    if (factor.info() != Eigen::Success || !innovation.allFinite()) break;
    solved = factor.solve(innovation);
    error = prior * jacobian.transpose() * solved;
  }
  if (factor.info() != Eigen::Success || !error.allFinite() || solved.size() == 0) {
    return absl::FailedPreconditionError("innovation covariance is not positive definite");
  }

  // All that shares knowledge with them follows.
  const std::vector<BlockId> connected = Connected(blocks);
  std::vector<Eigen::MatrixXd> gains;  // P H^T L^-T of each
  for (const BlockId id : connected) {
    Eigen::MatrixXd with = Eigen::MatrixXd::Zero(state(id).dim(), jacobian.rows());
    int column = 0;
    for (const BlockId seen : blocks) {
      const auto part = jacobian.middleCols(column, state(seen).dim());
      if (seen == id) {
        with += covariance(id) * part.transpose();
      } else if (Share(id, seen)) {
        with += Cross(id, seen) * part.transpose();
      }
      column += static_cast<int>(part.cols());
    }
    gains.push_back(factor.matrixL().solve(with.transpose()).transpose());
  }
  const Eigen::VectorXd white = factor.matrixL().transpose() * solved;
  for (std::size_t a = 0; a < connected.size(); ++a) {
    blocks_.at(connected[a]).covariance -= gains[a] * gains[a].transpose();
    for (std::size_t b = a + 1; b < connected.size(); ++b) {
      Eigen::MatrixXd& cross = cross_[Pair(connected[a], connected[b])];
      if (cross.size() == 0) cross.setZero(gains[a].rows(), gains[b].rows());
      cross -= gains[a] * gains[b].transpose();
    }
  }
  for (std::size_t a = 0; a < connected.size(); ++a) Correct(connected[a], gains[a] * white);
  return update;
}

void TeamFilter::Correct(BlockId id, const Eigen::VectorXd& error) {
  Block& block = blocks_.at(id);
  block.state = Moved(block.state, error);
  // Rotation errors are counted from the new estimate (slam-spec 1: G).
  if (block.state.pose) Turn(id, RightJacobianSo3(error.segment<3>(3)));
}

void TeamFilter::Turn(BlockId id, const Eigen::Matrix3d& turn) {
  Eigen::MatrixXd& own = blocks_.at(id).covariance;
  own.middleRows<3>(3) = (turn * own.middleRows<3>(3)).eval();
  own.middleCols<3>(3) = (own.middleCols<3>(3) * turn.transpose()).eval();
  own = (0.5 * (own + own.transpose())).eval();
  for (auto& [pair, cross] : cross_) {
    if (pair.first == id) cross.middleRows<3>(3) = (turn * cross.middleRows<3>(3)).eval();
    if (pair.second == id) {
      cross.middleCols<3>(3) = (cross.middleCols<3>(3) * turn.transpose()).eval();
    }
  }
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
