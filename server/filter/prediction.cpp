// The part of FilterState that says where things are seen and how sure that is.
#include <algorithm>
#include <array>
#include <cmath>

#include "server/filter/filter_state.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr int kPose = FilterState::kPoseDim;
constexpr int kPoses = 2 * kPose;  // the camera's and the clone's
constexpr int kMostColumns = kPoses + 3;
using SmallRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, kMostColumns>;

}  // namespace

PointFromClone FilterState::Point(const Feature& feature, bool first) const {
  const Clone& clone = CloneOf(feature);
  const PointInClone& in_clone = first ? feature.first : feature.point;
  return {first ? clone.first : clone.pose, in_clone.bearing, in_clone.basis,
          feature.point.inverse_range};
}

PointFromClone FilterState::Point(FeatureId id) const { return Point(*Find(id), false); }

FilterState::SmallMatrix FilterState::Gather(const Robot& robot, const Clone& clone,
                                             const Feature& feature) const {
  const int size = kPoses + form_->dim();
  const int camera = At(robot.block), from = At(clone.block), point = At(feature.block);
  std::array<int, kMostColumns> rows{};
  for (int k = 0; k < kPose; ++k) {
    rows[k] = camera + k;
    rows[kPose + k] = from + k;
  }
  for (int k = kPoses; k < size; ++k) rows[k] = point + k - kPoses;
  const bool shared = IslandOf(robot.block) == IslandOf(clone.block);
  const Covariance& p = IslandAt(IslandOf(clone.block)).p;
  SmallMatrix block(size, size);
  for (int c = shared ? 0 : kPose; c < size; ++c) {
    for (int r = c; r < size; ++r) block(r, c) = block(c, r) = p.at(rows[r], rows[c]);
  }
  if (shared) return block;
  block.topRows<kPose>().setZero();
  block.leftCols<kPose>().setZero();
  block.topLeftCorner<kPose, kPose>() = PoseCovariance(robot.id);
  return block;
}

std::optional<PixelPrediction> FilterState::Linearise(const CameraModel& camera, const Robot& robot,
                                                      const Feature& feature) const {
  const Rigid3& pose = robot.motion.world_from_camera;
  auto current = PredictFromClone(camera, pose, Point(feature, false));
  if (!current || !Fej(IslandOf(robot.block))) return current;
  const auto first = PredictFromClone(camera, pose, Point(feature, true));
  if (!first) return current;
  PixelPrediction mixed = *first;
  mixed.pixel = current->pixel;
  mixed.ray = current->ray;
  return mixed;
}

std::optional<PredictedPixel> FilterState::Predicted(const CameraModel& camera, FeatureId id,
                                                     RobotId robot) const {
  const Feature* feature = Find(id);
  if (feature == nullptr) return std::nullopt;
  const auto at = Linearise(camera, Of(robot), *feature);
  if (!at) return std::nullopt;
  const SmallMatrix p = Gather(Of(robot), CloneOf(*feature), *feature);
  SmallRows h(2, p.cols());
  h << at->d_camera, at->d_clone, form_->InState(at->d_point);
  const SmallRows hp = h * p;
  PredictedPixel result{*at, hp * h.transpose(), hp.leftCols<6>()};
  const Eigen::Matrix2d d_bearing = at->d_point.leftCols<2>();
  result.covariance += d_bearing * form_->Frozen(feature->birth_covariance) * d_bearing.transpose();
  return result;
}

std::optional<PredictedPixel> FilterState::Predicted(const CameraModel& camera,
                                                     const Vector3d& known_point,
                                                     RobotId robot) const {
  const auto at = PredictFixed(camera, Of(robot).motion.world_from_camera, known_point);
  if (!at) return std::nullopt;
  const Eigen::Matrix<double, 2, 6> hp = at->d_camera * PoseCovariance(robot);
  return PredictedPixel{*at, hp * at->d_camera.transpose(), hp};
}

std::optional<DepthLine> FilterState::LineOf(FeatureId id, RobotId robot) const {
  const Feature* feature = Find(id);
  if (feature == nullptr) return std::nullopt;
  DepthLine line;
  line.line = Point(*feature, /*first=*/false);
  line.world_from_camera = Of(robot).motion.world_from_camera;
  const SmallMatrix p = Gather(Of(robot), CloneOf(*feature), *feature);
  const int known = std::min<int>(kPoses + form_->range(), line.covariance.rows());
  line.covariance.topLeftCorner(known, known) = p.topLeftCorner(known, known);
  line.covariance.bottomRightCorner<2, 2>() += form_->Frozen(feature->birth_covariance);
  return line;
}

FeatureMarginal FilterState::Marginal(FeatureId id, RobotId robot) const {
  FeatureMarginal marginal;
  const Feature* feature = Find(id);
  if (feature == nullptr) return marginal;
  const Clone& clone = CloneOf(*feature);
  const PointInClone& point = feature->point;
  const SmallMatrix p = Gather(Of(robot), clone, *feature);
  const int range = kPoses + form_->range();
  const double rho = std::max(point.inverse_range, options_.min_inverse_range);
  const Matrix3d world_from_clone = clone.pose.RotationMatrix();
  const Vector3d in_clone = point.bearing / rho;
  marginal.inverse_range = point.inverse_range;
  marginal.inverse_range_sigma = std::sqrt(std::max(0.0, p(range, range)));
  marginal.point_in_world = clone.pose * in_clone;
  Eigen::Matrix<double, 3, 3> d_point;  // by [bearing tangent, inverse range]
  d_point.leftCols<2>() = world_from_clone * point.basis / rho;
  d_point.col(2) = world_from_clone * in_clone / -rho;
  SmallRows in_world(3, p.cols());
  in_world << Eigen::Matrix<double, 3, 6>::Zero(), Matrix3d::Identity(),
      -world_from_clone * Skew(in_clone), form_->InState(d_point);
  const Rigid3 camera_from_world = camera(robot).world_from_camera.Inverse();
  const Matrix3d turn = camera_from_world.RotationMatrix();
  SmallRows in_camera = turn * in_world;
  in_camera.leftCols<3>() = -turn;
  in_camera.middleCols<3>(3) = Skew(camera_from_world * marginal.point_in_world);
  marginal.covariance_in_world = in_world * p * in_world.transpose();
  marginal.covariance_in_camera = in_camera * p * in_camera.transpose();
  const Matrix3d frozen = d_point.leftCols<2>() * form_->Frozen(feature->birth_covariance) *
                          d_point.leftCols<2>().transpose();
  marginal.covariance_in_world += frozen;
  marginal.covariance_in_camera += turn * frozen * turn.transpose();
  return marginal;
}

}  // namespace saccade
