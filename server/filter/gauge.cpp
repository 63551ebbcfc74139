// The part of FilterState that writes it in other coordinates, or counts errors from elsewhere.
#include <algorithm>
#include <cmath>

#include "server/filter/filter_state.hpp"

namespace saccade {

bool FilterState::CountErrorsFrom(CloneId id) {
  const Clone* from = FindClone(id);
  if (from == nullptr || Fej(IslandOf(from->block))) return false;
  const int number = IslandOf(from->block);
  Covariance& p = IslandAt(number).p;
  Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(p.dim(), kPoseDim);
  for (const Robot& robot : In(number, robots_)) {
    robot.model->ByOrigin(robot.motion, from->pose,
                          moved.middleRows(At(robot.block), robot.model->dim()));
  }
  for (const Clone& each : In(number, clones_)) {
    PoseByOrigin(each.pose, from->pose, moved.middleRows<kPoseDim>(At(each.block)));
  }
  p.Condition(moved, At(from->block));
  return true;
}

double FilterState::DirectionSigma(CloneId id) const {
  const Clone* clone = FindClone(id);
  if (clone == nullptr) return 0.0;
  const Covariance& p = IslandAt(IslandOf(clone->block)).p;
  const int at = At(clone->block);
  double variance = 0.0;
  for (int k = 3; k < kPoseDim; ++k) variance += p.at(at + k, at + k);
  return std::sqrt(std::max(0.0, variance / 3.0));
}

void FilterState::MoveWorld(const Similarity3& world_from_before, RobotId id) {
  const int number = IslandOf(Of(id).block);
  Island& island = IslandAt(number);
  island.checkpoint.reset();
  const double scale = world_from_before.scale;
  const Eigen::Matrix3d turn = scale * world_from_before.rotation.toRotationMatrix();
  Matrix6d by = Matrix6d::Identity();  // of a pose
  by.topLeftCorner<3, 3>() = turn;
  for (Robot& robot : In(number, robots_)) {
    island.p.TransformBlock(At(robot.block), robot.model->InMovedWorld(turn));
    robot.motion.world_from_camera = world_from_before.Move(robot.motion.world_from_camera);
    robot.motion.velocity_m_s = turn * robot.motion.velocity_m_s;
    robot.motion.imu.gravity_m_s2 = world_from_before.rotation * robot.motion.imu.gravity_m_s2;
    robot.first_pose = world_from_before.Move(robot.first_pose);
    if (robot.head) {
      robot.head->rate.head<3>() = turn * robot.head->rate.head<3>();
      robot.head->covariance = (by * robot.head->covariance * by.transpose()).eval();
    }
  }
  for (Clone& clone : In(number, clones_)) {
    clone.pose = world_from_before.Move(clone.pose);
    clone.first = world_from_before.Move(clone.first);
    island.p.TransformBlock(At(clone.block), by);
  }
  for (Feature& feature : In(number, features_)) {
    feature.point.inverse_range /= scale;
    island.p.TransformBlock(At(feature.block) + form_->range(),
                            Eigen::Matrix<double, 1, 1>(1.0 / scale));
  }
}

}  // namespace saccade
