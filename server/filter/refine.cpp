// The part of FilterState that takes over better estimates (bundle adjustment).
#include <algorithm>
#include <iterator>

#include "server/filter/filter_state.hpp"

namespace saccade {
namespace {

Eigen::Matrix<double, 6, 1> PoseStep(const Rigid3& from, const Rigid3& to) {
  Eigen::Matrix<double, 6, 1> step;
  step << to.translation - from.translation, LogQuaternion(from.rotation.conjugate() * to.rotation);
  return step;
}

}  // namespace

void FilterState::SetCheckpoint(RobotId id) {
  const Robot& robot = Of(id);
  const int number = IslandOf(robot.block);
  Checkpoint& checkpoint = IslandAt(number).checkpoint.emplace();
  checkpoint.layout = layout_;
  checkpoint.robot = robot;
  std::ranges::copy(In(number, clones_), std::back_inserter(checkpoint.clones));
  std::ranges::copy(In(number, features_), std::back_inserter(checkpoint.features));
}

void FilterState::DropCheckpoint(RobotId id) {
  IslandAt(IslandOf(Of(id).block)).checkpoint.reset();
}

void FilterState::Refine(const Refinement& refinement, RobotId id) {
  const int number = IslandOf(Of(id).block);
  Island& island = IslandAt(number);
  if (!island.checkpoint || island.checkpoint->robot.id != id) return;
  const Checkpoint& checkpoint = *island.checkpoint;
  Eigen::VectorXd step = Eigen::VectorXd::Zero(checkpoint.layout.dim(number));
  const auto part = [&](BlockId block) {
    return step.segment(checkpoint.layout[block].offset, checkpoint.layout[block].size);
  };
  if (refinement.world_from_camera) {
    const CameraMotion& then = checkpoint.robot.motion;
    CameraMotion moved = then;
    moved.world_from_camera = *refinement.world_from_camera;
    moved.velocity_m_s = moved.world_from_camera.rotation *
                         (then.world_from_camera.rotation.conjugate() * moved.velocity_m_s);
    part(checkpoint.robot.block) = checkpoint.robot.model->Minus(moved, then);
  }
  for (const Clone& clone : checkpoint.clones) {
    const auto better = refinement.clones.find(clone.id);
    if (better == refinement.clones.end()) continue;
    part(clone.block) = PoseStep(clone.pose, better->second);
  }
  for (const Feature& feature : checkpoint.features) {
    const auto better = refinement.features.find(feature.id);
    if (better == refinement.features.end()) continue;
    part(feature.block) =
        form_->Minus(better->second.bearing, better->second.inverse_range, feature.point);
  }
  step = checkpoint.journal.Carry(std::move(step));
  island.checkpoint.reset();
  if (!step.allFinite() || step.size() != island.p.dim()) return;
  CarryScale(step, number);
  Correct(step, number);
  for (Robot& robot : In(number, robots_)) robot.first_pose = robot.motion.world_from_camera;
}

}  // namespace saccade
