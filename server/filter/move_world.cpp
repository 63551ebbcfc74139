// The part of FilterState that writes it in other coordinates.
#include "server/filter/filter_state.hpp"

namespace saccade {

void FilterState::MoveWorld(const Similarity3& world_from_before) {
  mark_.reset();
  const double scale = world_from_before.scale;
  const Eigen::Matrix3d turn = scale * world_from_before.rotation.toRotationMatrix();
  Matrix6d by = Matrix6d::Identity();  // of a pose
  by.topLeftCorner<3, 3>() = turn;
  covariance_.TransformBlock(0, motion_->InMovedWorld(turn));
  camera_.world_from_camera = world_from_before.Move(camera_.world_from_camera);
  camera_.velocity_m_s = turn * camera_.velocity_m_s;
  first_pose_ = world_from_before.Move(first_pose_);
  if (head_) {
    head_->rate.head<3>() = turn * head_->rate.head<3>();
    head_->covariance = (by * head_->covariance * by.transpose()).eval();
  }
  for (Anchor& anchor : anchors_) {
    anchor.pose = world_from_before.Move(anchor.pose);
    anchor.first = world_from_before.Move(anchor.first);
    covariance_.TransformBlock(anchor.offset, by);
  }
  for (Feature& feature : features_) {
    feature.point.inverse_range /= scale;
    covariance_.TransformBlock(feature.offset + form_->range(),
                               Eigen::Matrix<double, 1, 1>(1.0 / scale));
  }
}

}  // namespace saccade
