#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/team/block_state.hpp"

namespace saccade {

/// Never used twice.
using BlockId = int;
enum class TeamBlockKind { kRobot, kCamera, kMarker, kMapFrame, kFeature };

/// What an observation depends on, at one linearisation point: rows x block dim each.
struct BlockJacobian {
  BlockId block = 0;
  Eigen::MatrixXd jacobian;
};
struct ObservationModel {
  Eigen::VectorXd residual;                // measured - expected
  std::vector<Eigen::MatrixXd> jacobians;  // of `expected`, in the order of the blocks asked about
};
/// Expectation at given states, in the order of the blocks; nothing where it cannot be seen.
using Expectation =
    std::function<std::optional<ObservationModel>(std::span<const BlockState* const>)>;

struct UpdateOptions {
  /// Degrees of freedom of Student's t: a measurement whose error is d sigmas weighs
  /// (dof + rows) / (dof + d^2), never nothing. 0: Gaussian.
  double student_dof = 0.0;
  int iterations = 1;  // of linearisation
};
struct BlockUpdate {
  double distance2 = 0.0;  // innovation^T S^-1 innovation before any weight
  double weight = 1.0;     // of the measurement's information
};

/// Any number of things in one filter: robots, static cameras, markers, map frames, features, each
/// a named block of the state, with one joint covariance (Schmidt 2014; slam-spec 1, 2, 11).
///
/// Only those cross-covariances are kept that are not zero: blocks that never had to do with each
/// other, however indirectly, cost nothing together, and neither changes a bit of the other. Blocks
/// come and go at any time. One thread. On an error nothing has changed.
class TeamFilter {
 public:
  /// A block that nobody knows anything of yet. InvalidArgument: the name is taken or empty,
  /// numbers are not finite, `covariance` is not dim x dim, symmetric, with a positive diagonal.
  absl::StatusOr<BlockId> Add(const std::string& name, TeamBlockKind kind, const BlockState& state,
                              const Eigen::MatrixXd& covariance);
  /// A block that was computed from others: error = sum of jacobian * error of each + noise
  /// (slam-spec 1, augmentation). InvalidArgument as Add, or sizes that do not fit.
  absl::StatusOr<BlockId> Derive(const std::string& name, TeamBlockKind kind,
                                 const BlockState& state, std::span<const BlockJacobian> from,
                                 const Eigen::MatrixXd& noise);
  /// NotFound: no such block.
  absl::Status Remove(BlockId id);

  /// `id` moves by itself: `state` is where to, error' = transition * error + noise.
  /// InvalidArgument: no such block, or sizes that do not fit.
  absl::Status Predict(BlockId id, const BlockState& state, const Eigen::MatrixXd& transition,
                       const Eigen::MatrixXd& noise);
  /// Corrects all that shares knowledge with `blocks` (iterated extended Kalman update).
  ///   InvalidArgument     no such block, or one twice; sizes that do not fit
  ///   OutOfRange          cannot be seen from where things are
  ///   FailedPrecondition  innovation covariance not positive definite, or not finite
  absl::StatusOr<BlockUpdate> Update(std::span<const BlockId> blocks,
                                     const Expectation& expectation, const Eigen::MatrixXd& noise,
                                     const UpdateOptions& options);

  std::optional<BlockId> Find(const std::string& name) const;
  bool Has(BlockId id) const { return blocks_.contains(id); }
  const std::string& name(BlockId id) const { return blocks_.at(id).name; }
  TeamBlockKind kind(BlockId id) const { return blocks_.at(id).kind; }
  const BlockState& state(BlockId id) const { return blocks_.at(id).state; }
  const Eigen::MatrixXd& covariance(BlockId id) const { return blocks_.at(id).covariance; }
  /// Of `a`'s errors with `b`'s; zero where they share nothing.
  Eigen::MatrixXd Cross(BlockId a, BlockId b) const;
  bool Share(BlockId a, BlockId b) const { return CrossOf(a, b) != nullptr; }
  std::vector<BlockId> blocks() const;  // in the order in which they came
  /// Covariance of all errors, block after block.
  Eigen::MatrixXd FullCovariance() const;

 private:
  struct Block {
    std::string name;
    TeamBlockKind kind;
    BlockState state;
    Eigen::MatrixXd covariance;
  };
  using Pair = std::pair<BlockId, BlockId>;  // first < second
  struct Solution;

  static absl::Status NoBlock(BlockId id);
  const Eigen::MatrixXd* CrossOf(BlockId a, BlockId b) const;
  absl::Status CheckNew(const std::string& name, const BlockState& state,
                        const Eigen::MatrixXd& covariance) const;
  std::vector<BlockId> Connected(std::span<const BlockId> blocks) const;
  absl::StatusOr<ObservationModel> Ask(std::span<const BlockId> blocks,
                                       const Expectation& expectation,
                                       const std::vector<BlockState>& at,
                                       const Eigen::MatrixXd& noise) const;
  absl::StatusOr<Solution> Solve(std::span<const BlockId> blocks, const Expectation& expectation,
                                 const Eigen::MatrixXd& noise, const UpdateOptions& options) const;
  void Spread(std::span<const BlockId> blocks, const Solution& solution);
  Eigen::MatrixXd Among(std::span<const BlockId> blocks) const;
  void Correct(BlockId id, const Eigen::VectorXd& error);
  void Turn(BlockId id, const Eigen::Matrix3d& turn);

  std::map<BlockId, Block> blocks_;
  std::map<Pair, Eigen::MatrixXd> cross_;  // of the first's errors with the second's
  BlockId next_ = 1;
};

}  // namespace saccade
