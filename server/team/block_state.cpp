#include "server/team/block_state.hpp"

namespace saccade {

BlockState Moved(const BlockState& state, const Eigen::VectorXd& error) {
  BlockState moved = state;
  if (moved.pose) {
    moved.pose->translation += error.head<3>();
    moved.pose->rotation = (moved.pose->rotation * ExpQuaternion(error.segment<3>(3))).normalized();
  }
  moved.numbers += error.tail(state.numbers.size());
  return moved;
}

Eigen::VectorXd Difference(const BlockState& from, const BlockState& to) {
  Eigen::VectorXd error(from.dim());
  if (from.pose) {
    error.head<3>() = to.pose->translation - from.pose->translation;
    error.segment<3>(3) = LogQuaternion(from.pose->rotation.conjugate() * to.pose->rotation);
  }
  error.tail(from.numbers.size()) = to.numbers - from.numbers;
  return error;
}

}  // namespace saccade
