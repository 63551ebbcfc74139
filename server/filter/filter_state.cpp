#include "server/filter/filter_state.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/filter/inertial_motion.hpp"

namespace saccade {

FilterState::FilterState(const FilterOptions& options)
    : options_(options), form_(&ParametrisationOf(options.form)) {
  Reset(CameraMotion(), Matrix12d::Zero());
}

void FilterState::Reset(const CameraMotion& camera, const Matrix12d& covariance) {
  layout_.Clear();
  islands_.clear();
  robots_.clear();
  clones_.clear();
  features_.clear();
  next_robot_ = kFirstRobot;
  next_clone_ = 1;
  AddRobot(camera, covariance,
           {.readout_s = options_.readout_s, .readout_sigma_s = options_.readout_sigma_s});
}

RobotId FilterState::AddRobot(const CameraMotion& camera, const Matrix12d& covariance,
                              const RobotOptions& options) {
  const int island = layout_.AddIsland();
  islands_.resize(static_cast<std::size_t>(layout_.islands()));
  IslandAt(island) = Island();
  Robot robot;
  robot.id = next_robot_++;
  robot.model = options.motion;
  const bool moves = robot.model->velocities() >= 0;
  robot.block = Append(moves ? BlockKind::kRobot : BlockKind::kCamera, robot.model->dim(), island);
  robot.readout_s = options.readout_s;
  if (options.readout_sigma_s > 0.0) {
    robot.readout = Append(BlockKind::kReadout, 1, island);
    const double variance = options.readout_sigma_s * options.readout_sigma_s;
    IslandAt(island).p.AddBlock(At(robot.readout), Eigen::Matrix<double, 1, 1>(variance));
  }
  robots_.push_back(robot);
  ResetCamera(camera, covariance, robot.id);
  return robot.id;
}

void FilterState::ResetCamera(const CameraMotion& camera, const Matrix12d& covariance, RobotId id) {
  Robot& robot = Of(id);
  Island& island = IslandAt(IslandOf(robot.block));
  island.checkpoint.reset();
  robot.head = HeadRate();
  const ImuState unit = robot.motion.imu;  // elsewhere it is the same unit
  robot.motion = camera;
  if (robot.model == &InertialMotion()) {
    robot.head.reset();
    robot.motion.imu = unit;
  }
  robot.first_pose = camera.world_from_camera;
  const int common = robot.model->common();
  island.p.ReplaceBlock(At(robot.block),
                        robot.model->InState(covariance).topLeftCorner(common, common));
}

void FilterState::RemoveRobot(RobotId id) {
  if (id == kFirstRobot || !HasRobot(id)) return;
  const Robot& robot = Of(id);
  std::vector<BlockId> gone = {robot.block};
  if (robot.readout != kNoBlock) gone.push_back(robot.readout);
  IslandAt(IslandOf(robot.block)).checkpoint.reset();
  RemoveBlocks(gone);
  std::erase_if(robots_, [&](const Robot& each) { return each.id == id; });
}

FilterState::Robot& FilterState::Of(RobotId id) {
  return *std::ranges::lower_bound(robots_, id, {}, &Robot::id);
}

const FilterState::Robot& FilterState::Of(RobotId id) const {
  return *std::ranges::lower_bound(robots_, id, {}, &Robot::id);
}

bool FilterState::HasRobot(RobotId id) const {
  return std::ranges::binary_search(robots_, id, {}, &Robot::id);
}

Matrix12d FilterState::CameraCovariance(RobotId id) const {
  const Robot& robot = Of(id);
  const int at = At(robot.block), size = robot.model->common();
  const Covariance& p = IslandAt(IslandOf(robot.block)).p;
  Matrix12d covariance = Matrix12d::Zero();
  covariance.topLeftCorner(size, size) = p.Block(at, at, size, size);
  if (robot.model == &InertialMotion()) {
    const int bias = at + InertialErrors::kGyroBias;  // what is left of the turn rate's errors
    covariance.bottomRightCorner<3, 3>() = p.Block(bias, bias, 3, 3);
  }
  return covariance;
}

Matrix6d FilterState::PoseCovariance(RobotId id) const {
  const BlockId block = Of(id).block;
  return IslandAt(IslandOf(block)).p.Block(At(block), At(block), kPoseDim, kPoseDim);
}

Eigen::MatrixXd FilterState::FullCovariance() const {
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(dim(), dim());
  int at = 0;
  for (const Island& island : islands_) {
    const int size = island.p.dim();
    full.block(at, at, size, size) = island.p.Full();
    at += size;
  }
  return full;
}

std::vector<FeatureId> FilterState::FeatureIds() const {
  std::vector<FeatureId> ids;
  ids.reserve(features_.size());
  for (const Feature& feature : features_) ids.push_back(feature.id);
  return ids;
}

const FilterState::Feature* FilterState::Find(FeatureId id) const {
  const auto at = std::ranges::lower_bound(features_, id, {}, &Feature::id);
  return at != features_.end() && at->id == id ? &*at : nullptr;
}

const FilterState::Clone* FilterState::FindClone(CloneId id) const {
  const auto at = std::ranges::lower_bound(clones_, id, {}, &Clone::id);
  return at != clones_.end() && at->id == id ? &*at : nullptr;
}

std::optional<Rigid3> FilterState::ClonePose(CloneId id) const {
  const Clone* clone = FindClone(id);
  if (clone == nullptr) return std::nullopt;
  return clone->pose;
}

}  // namespace saccade
