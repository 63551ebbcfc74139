// The part of FilterState whose cameras are carried by inertial units.
#include <array>

#include "server/filter/filter_state.hpp"

namespace saccade {

using Eigen::MatrixXd;
using Eigen::VectorXd;

bool FilterState::inertial(RobotId id) const { return Of(id).model == &InertialMotion(); }

MatrixXd FilterState::InertialCovariance(RobotId id) const {
  const Robot& robot = Of(id);
  const int at = At(robot.block), size = robot.model->dim();
  return IslandAt(IslandOf(robot.block)).p.Block(at, at, size, size);
}

VectorXd FilterState::ScaleDirection(int number, const Eigen::Vector3d& origin) const {
  VectorXd direction = VectorXd::Zero(layout_.dim(number));
  for (const Robot& robot : In(number, robots_)) {
    direction.segment<3>(At(robot.block)) = robot.motion.world_from_camera.translation - origin;
  }
  for (const Clone& clone : In(number, clones_)) {
    direction.segment<3>(At(clone.block)) = clone.pose.translation - origin;
  }
  for (const Feature& feature : In(number, features_)) {
    direction[At(feature.block) + form_->range()] = -feature.point.inverse_range;
  }
  return direction;
}

void FilterState::StartInertial(const InertialSolution& solution, const Eigen::Vector3d& origin,
                                RobotId id) {
  constexpr int kOwn = InertialErrors::kDim - kPoseDim;  // beside the pose
  Robot& robot = Of(id);
  const int number = IslandOf(robot.block);
  Island& island = IslandAt(number);
  island.checkpoint.reset();
  const VectorXd direction = ScaleDirection(number, origin);
  const double variance = solution.covariance(0, 0);
  Covariance& p = island.p;
  for (int c = 0; c < p.dim(); ++c) {
    for (int r = c; r < p.dim(); ++r) p.lower(r, c) += variance * direction[r] * direction[c];
  }
  const int before = p.dim(), old = At(robot.block);
  const MatrixXd pose = p.Block(old, 0, kPoseDim, before);
  const BlockId block = Append(BlockKind::kRobot, InertialErrors::kDim, number);
  const int at = At(block);
  const MatrixXd& all = solution.covariance;
  for (int c = 0; c < before; ++c) {
    for (int r = 0; r < kPoseDim; ++r) p.lower(at + r, c) = pose(r, c);
    for (int r = 0; r < kOwn; ++r) {
      p.lower(at + kPoseDim + r, c) = all(1 + kPoseDim + r, 0) * direction[c];
    }
  }
  MatrixXd own(InertialErrors::kDim, InertialErrors::kDim);
  own.topLeftCorner<kPoseDim, kPoseDim>() = pose.middleCols<kPoseDim>(old);
  own.bottomLeftCorner<kOwn, kPoseDim>() =
      all.block<kOwn, 1>(1 + kPoseDim, 0) * direction.segment<kPoseDim>(old).transpose();
  own.topRightCorner<kPoseDim, kOwn>() = own.bottomLeftCorner<kOwn, kPoseDim>().transpose();
  own.bottomRightCorner<kOwn, kOwn>() = all.bottomRightCorner<kOwn, kOwn>();
  p.AddBlock(at, own);
  RemoveBlocks(std::array{robot.block});
  robot.block = block;
  robot.model = &InertialMotion();
  robot.head.reset();
  const Rigid3 now = robot.motion.world_from_camera;
  robot.motion = solution.motion;
  robot.motion.world_from_camera = now;
}

bool FilterState::PredictInertial(const ImuStep& step, const MotionNoise& noise, RobotId id) {
  Robot& robot = Of(id);
  if (!Covers(step, robot.motion.imu.offset_s)) {
    Predict(Seconds(step.to_ns - step.from_ns), noise, nullptr, id);
    return false;
  }
  MotionModel::Step by = PropagateInertial(robot.motion, step);
  if (Fej(IslandOf(robot.block))) {
    const Eigen::Quaterniond& now = robot.motion.world_from_camera.rotation;
    by.f.middleCols<3>(InertialErrors::kRotation) *=
        (now.conjugate() * robot.first_pose.rotation).toRotationMatrix();
  }
  Follow(by, robot);
  return true;
}

}  // namespace saccade
