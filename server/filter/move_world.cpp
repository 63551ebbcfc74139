// The part of FilterState that writes it in other coordinates.
#include "server/filter/filter_state.hpp"

namespace saccade {

void FilterState::MoveWorld(const Similarity3& world_from_before) {
  mark_.reset();
  const double scale = world_from_before.scale;
  const Eigen::Matrix3d turn = scale * world_from_before.rotation.toRotationMatrix();
  Matrix12d by = Matrix12d::Identity();
  by.topLeftCorner<3, 3>() = by.block<3, 3>(6, 6) = turn;
  covariance_.TransformBlock(0, by);
  camera_.world_from_camera = world_from_before.Move(camera_.world_from_camera);
  camera_.velocity_m_s = turn * camera_.velocity_m_s;
  first_pose_ = world_from_before.Move(first_pose_);
  if (head_) {
    head_->rate.head<3>() = turn * head_->rate.head<3>();
    head_->covariance = (by.bottomRightCorner<6, 6>() * head_->covariance *
                         by.bottomRightCorner<6, 6>().transpose())
                            .eval();
  }
  for (Anchor& anchor : anchors_) {
    anchor.pose = world_from_before.Move(anchor.pose);
    anchor.first = world_from_before.Move(anchor.first);
    covariance_.TransformBlock(anchor.offset, by.topLeftCorner<6, 6>());
  }
  const int last = FeatureDim() - 1;
  for (Feature& feature : features_) {
    feature.inverse_range /= scale;
    covariance_.TransformBlock(feature.offset + last, Eigen::Matrix<double, 1, 1>(1.0 / scale));
  }
}

}  // namespace saccade
