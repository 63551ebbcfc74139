// The part of FilterState that takes over better estimates (bundle adjustment).
#include <algorithm>

#include "server/filter/filter_state.hpp"

namespace saccade {
namespace {

Eigen::Matrix<double, 6, 1> PoseStep(const Rigid3& from, const Rigid3& to) {
  Eigen::Matrix<double, 6, 1> step;
  step << to.translation - from.translation, LogQuaternion(from.rotation.conjugate() * to.rotation);
  return step;
}

}  // namespace

std::optional<Rigid3> FilterState::AnchorPose(AnchorPoseId id) const {
  const auto at = std::lower_bound(anchors_.begin(), anchors_.end(), id,
                                   [](const Anchor& a, AnchorPoseId key) { return a.id < key; });
  if (at == anchors_.end() || at->id != id) return std::nullopt;
  return at->pose;
}

void FilterState::Mark() {
  mark_.emplace();
  mark_->camera = camera_;
  mark_->anchors = anchors_;
  mark_->features = features_;
  mark_->dim = dim();
}

void FilterState::DropMark() { mark_.reset(); }

void FilterState::Refine(const Refinement& refinement) {
  if (!mark_) return;
  const Marked& mark = *mark_;
  Eigen::VectorXd step = Eigen::VectorXd::Zero(mark.dim);
  if (refinement.world_from_camera) {
    CameraMotion moved = mark.camera;
    moved.world_from_camera = *refinement.world_from_camera;
    moved.velocity_m_s = moved.world_from_camera.rotation *
                         (mark.camera.world_from_camera.rotation.conjugate() * moved.velocity_m_s);
    step.head(motion_->dim()) = motion_->Minus(moved, mark.camera);
  }
  for (const Anchor& anchor : mark.anchors) {
    const auto better = refinement.anchors.find(anchor.id);
    if (better == refinement.anchors.end()) continue;
    step.segment<kPoseDim>(anchor.offset) = PoseStep(anchor.pose, better->second);
  }
  for (const Feature& feature : mark.features) {
    const auto better = refinement.features.find(feature.id);
    if (better == refinement.features.end()) continue;
    step.segment(feature.offset, form_->dim()) =
        form_->Minus(better->second.bearing, better->second.inverse_range, feature.point);
  }
  step = mark.journal.Carry(std::move(step));
  mark_.reset();
  if (!step.allFinite() || step.size() != dim()) return;
  CarryScale(step);
  Correct(step);
  first_pose_ = camera_.world_from_camera;
}

}  // namespace saccade
