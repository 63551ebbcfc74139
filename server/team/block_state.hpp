#pragma once

#include <Eigen/Dense>
#include <optional>

#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// What one thing of a team is: a pose, or numbers, or both.
///
/// Errors, in this order: position in the parent [m] and rotation on the right [rad] of the pose,
/// if there is one; then the numbers, additive.
struct BlockState {
  std::optional<Rigid3> pose;  // parent_from_block
  Eigen::VectorXd numbers;

  int dim() const { return (pose ? 6 : 0) + static_cast<int>(numbers.size()); }
};

/// `state` [+] `error`.
BlockState Moved(const BlockState& state, const Eigen::VectorXd& error);
/// `to` [-] `from`: Moved(from, Difference(from, to)) is `to`.
Eigen::VectorXd Difference(const BlockState& from, const BlockState& to);

}  // namespace saccade
