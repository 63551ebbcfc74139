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

void FilterState::Mark(RobotId id) {
  const Robot& robot = Of(id);
  const int number = IslandOf(robot.block);
  Marked& mark = IslandAt(number).mark.emplace();
  mark.layout = layout_;
  mark.robot = robot;
  std::ranges::copy(In(number, anchors_), std::back_inserter(mark.anchors));
  std::ranges::copy(In(number, features_), std::back_inserter(mark.features));
}

void FilterState::DropMark(RobotId id) { IslandAt(IslandOf(Of(id).block)).mark.reset(); }

void FilterState::Refine(const Refinement& refinement, RobotId id) {
  const int number = IslandOf(Of(id).block);
  Island& island = IslandAt(number);
  if (!island.mark || island.mark->robot.id != id) return;
  const Marked& mark = *island.mark;
  Eigen::VectorXd step = Eigen::VectorXd::Zero(mark.layout.dim(number));
  const auto part = [&](BlockId block) {
    return step.segment(mark.layout[block].offset, mark.layout[block].size);
  };
  if (refinement.world_from_camera) {
    const CameraMotion& then = mark.robot.motion;
    CameraMotion moved = then;
    moved.world_from_camera = *refinement.world_from_camera;
    moved.velocity_m_s = moved.world_from_camera.rotation *
                         (then.world_from_camera.rotation.conjugate() * moved.velocity_m_s);
    part(mark.robot.block) = mark.robot.model->Minus(moved, then);
  }
  for (const Anchor& anchor : mark.anchors) {
    const auto better = refinement.anchors.find(anchor.id);
    if (better == refinement.anchors.end()) continue;
    part(anchor.block) = PoseStep(anchor.pose, better->second);
  }
  for (const Feature& feature : mark.features) {
    const auto better = refinement.features.find(feature.id);
    if (better == refinement.features.end()) continue;
    part(feature.block) =
        form_->Minus(better->second.bearing, better->second.inverse_range, feature.point);
  }
  step = mark.journal.Carry(std::move(step));
  island.mark.reset();
  if (!step.allFinite() || step.size() != island.p.dim()) return;
  CarryScale(step, number);
  Correct(step, number);
  for (Robot& robot : In(number, robots_)) robot.first_pose = robot.motion.world_from_camera;
}

}  // namespace saccade
