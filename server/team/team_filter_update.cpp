#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/team/team_filter.hpp"

namespace saccade {

/// The last linearisation of an update: innovation covariance S = L L^T.
struct TeamFilter::Solution {
  Eigen::MatrixXd jacobian;  // of all the blocks asked about, side by side
  Eigen::LLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd innovation;
  BlockUpdate update;
};

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

absl::StatusOr<TeamFilter::Solution> TeamFilter::Solve(std::span<const BlockId> blocks,
                                                       const Expectation& expectation,
                                                       const Eigen::MatrixXd& noise,
                                                       const UpdateOptions& options) const {
  std::vector<BlockState> at;
  for (const BlockId id : blocks) at.push_back(state(id));
  const Eigen::MatrixXd prior = Among(blocks);
  Eigen::VectorXd error = Eigen::VectorXd::Zero(prior.rows());
  Solution solution;
  for (int k = 0; k < std::max(1, options.iterations); ++k) {
    int column = 0;
    for (std::size_t b = 0; k > 0 && b < blocks.size(); ++b) {
      const int n = state(blocks[b]).dim();
      at[b] = Moved(state(blocks[b]), error.segment(column, n));
      column += n;
    }
    const absl::StatusOr<ObservationModel> model = Ask(blocks, expectation, at, noise);
    if (!model.ok()) return model.status();
    solution.jacobian.resize(model->residual.size(), prior.rows());
    column = 0;
    for (const Eigen::MatrixXd& each : model->jacobians) {
      solution.jacobian.middleCols(column, each.cols()) = each;
      column += static_cast<int>(each.cols());
    }
    solution.innovation = model->residual + solution.jacobian * error;
    const Eigen::MatrixXd spread = solution.jacobian * prior * solution.jacobian.transpose();
    BlockUpdate& update = solution.update;
    if (k == 0) {
      solution.factor.compute(spread + noise);
      update.distance2 = solution.innovation.dot(solution.factor.solve(solution.innovation));
      if (options.student_dof > 0) {
        const double rows = static_cast<double>(solution.innovation.size());
        update.weight =
            std::min(1.0, (options.student_dof + rows) / (options.student_dof + update.distance2));
      }
    }
    if (update.weight < 1.0 || k > 0) solution.factor.compute(spread + noise / update.weight);
    error = prior * solution.jacobian.transpose() * solution.factor.solve(solution.innovation);
    if (solution.factor.info() != Eigen::Success || !error.allFinite()) {
      return absl::FailedPreconditionError("innovation covariance is not positive definite");
    }
  }
  return solution;
}

absl::StatusOr<BlockUpdate> TeamFilter::Update(std::span<const BlockId> blocks,
                                               const Expectation& expectation,
                                               const Eigen::MatrixXd& noise,
                                               const UpdateOptions& options) {
  for (const BlockId id : blocks) {
    if (!Has(id)) return NoBlock(id);
    if (std::count(blocks.begin(), blocks.end(), id) > 1) {
      return absl::InvalidArgumentError(absl::StrCat(name(id), " is named twice"));
    }
  }
  const absl::StatusOr<Solution> solution = Solve(blocks, expectation, noise, options);
  if (!solution.ok()) return solution.status();
  Spread(blocks, *solution);
  return solution->update;
}

void TeamFilter::Spread(std::span<const BlockId> blocks, const Solution& solution) {
  const std::vector<BlockId> connected = Connected(blocks);
  std::vector<Eigen::MatrixXd> gains;  // P H^T L^-T of each
  for (const BlockId id : connected) {
    Eigen::MatrixXd with = Eigen::MatrixXd::Zero(state(id).dim(), solution.jacobian.rows());
    int column = 0;
    for (const BlockId seen : blocks) {
      const auto part = solution.jacobian.middleCols(column, state(seen).dim());
      if (seen == id) {
        with += covariance(id) * part.transpose();
      } else if (Share(id, seen)) {
        with += Cross(id, seen) * part.transpose();
      }
      column += static_cast<int>(part.cols());
    }
    gains.push_back(solution.factor.matrixL().solve(with.transpose()).transpose());
  }
  const Eigen::VectorXd white = solution.factor.matrixL().solve(solution.innovation);
  for (std::size_t a = 0; a < connected.size(); ++a) {
    blocks_.at(connected[a]).covariance -= gains[a] * gains[a].transpose();
    for (std::size_t b = a + 1; b < connected.size(); ++b) {
      Eigen::MatrixXd& cross = cross_[Pair(connected[a], connected[b])];
      if (cross.size() == 0) cross.setZero(gains[a].rows(), gains[b].rows());
      cross -= gains[a] * gains[b].transpose();
    }
  }
  for (std::size_t a = 0; a < connected.size(); ++a) Correct(connected[a], gains[a] * white);
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

}  // namespace saccade
