// The part of FilterState that makes one frame's matches linear.
#include <absl/strings/str_cat.h>

#include <Eigen/Cholesky>
#include <map>

#include "server/filter/filter_state.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

absl::Status NotInView(FeatureId id) {
  return absl::InvalidArgumentError(
      absl::StrCat("filter: feature ", id, " is unknown or not in view"));
}

}  // namespace

absl::Status FilterState::JoinSeen(std::span<const Observation> observations, RobotId id) {
  if (!HasRobot(id)) return absl::InvalidArgumentError(absl::StrCat("filter: no robot ", id));
  for (const Observation& seen : observations) {
    if (!seen.known_point && !Has(seen.id)) return NotInView(seen.id);
    if (seen.known_point && seen.marker != 0 && FindClone(seen.marker) == nullptr) {
      return absl::InvalidArgumentError(absl::StrCat("filter: no marker ", seen.marker));
    }
  }
  const BlockId robot = Of(id).block;
  for (const Observation& seen : observations) {
    if (!seen.known_point) Join(IslandOf(robot), IslandOf(Find(seen.id)->block));
    if (seen.known_point && seen.marker != 0) {
      Join(IslandOf(robot), IslandOf(FindClone(seen.marker)->block));
    }
  }
  return absl::OkStatus();
}

VectorXd FilterState::StepTo(const Rigid3& linearisation, const Robot& robot) const {
  CameraMotion moved = robot.motion;
  moved.world_from_camera = linearisation;
  const Eigen::Matrix<double, 6, 1> of_camera = Minus(moved, robot.motion).head<6>();
  const Covariance& p = IslandAt(IslandOf(robot.block)).p;
  const int at = At(robot.block);
  VectorXd step = VectorXd::Zero(p.dim());
  const Eigen::LDLT<Matrix6d> factor(PoseCovariance(robot.id));
  if (factor.info() == Eigen::Success && factor.vectorD().minCoeff() > 0.0) {
    MatrixXd columns(p.dim(), kPoseDim);
    p.CopyColumns(at, kPoseDim, columns);
    step = columns * factor.solve(of_camera);
    if (!step.allFinite()) step.setZero();
  }
  step.segment<6>(at) = of_camera;
  return step;
}

PointFromClone FilterState::MovedPoint(const Feature& feature, const VectorXd& step) const {
  const Clone& clone = CloneOf(feature);
  PointInClone point = feature.point;
  form_->Move(step.segment(At(feature.block), form_->dim()), point);
  return {PlusPose(clone.pose, step.segment<6>(At(clone.block))), point.bearing, point.basis,
          point.inverse_range};
}

std::optional<PixelPrediction> FilterState::LineariseOne(
    const CameraModel& camera, const Feature& feature, const Rigid3& linearisation,
    const VectorXd& step, Linearised::Rows& rows, Eigen::Vector2d& ahead) const {
  auto at = PredictFromClone(camera, linearisation, MovedPoint(feature, step));
  if (!at) return at;
  const bool fej = Fej(IslandOf(feature.block));
  if (fej) {
    if (const auto first = PredictFromClone(camera, linearisation, Point(feature, true))) {
      at->d_camera = first->d_camera;
      at->d_clone = first->d_clone;
      at->d_point = first->d_point;
    }
  }
  rows.clone = At(CloneOf(feature).block);
  rows.point = At(feature.block);
  if (!fej) {
    at->d_clone.rightCols<3>() *= RightJacobianSo3(step.segment<3>(rows.clone + 3)).eval();
  }
  ahead = at->d_clone * step.segment<6>(rows.clone) +
          form_->InState(at->d_point) * step.segment(rows.point, form_->dim());
  const Eigen::Matrix2d d_bearing = at->d_point.leftCols<2>();
  rows.noise += d_bearing * form_->Frozen(feature.birth_covariance) * d_bearing.transpose();
  return at;
}

std::optional<PixelPrediction> FilterState::LineariseMarker(
    const CameraModel& camera, const Observation& observation, const Rigid3& linearisation,
    const VectorXd& step, Linearised::Rows& rows, Eigen::Vector2d& ahead) const {
  const Clone& marker = *FindClone(observation.marker);
  rows.clone = rows.point = At(marker.block);
  const Rigid3 moved = PlusPose(marker.pose, step.segment<6>(rows.clone));
  auto at = PredictFixed(camera, linearisation, moved * *observation.known_point);
  if (!at) return at;
  // The point moves as its marker does, the other way than the camera.
  const Eigen::Matrix<double, 2, 3> d_point = -at->d_camera.leftCols<3>();
  at->d_clone << d_point, -d_point * moved.RotationMatrix() * Skew(*observation.known_point) *
                              RightJacobianSo3(step.segment<3>(rows.clone + 3));
  ahead = at->d_clone * step.segment<6>(rows.clone);
  return at;
}

absl::StatusOr<FilterState::Linearised> FilterState::LineariseAll(
    const CameraModel& camera, std::span<const Observation> observations,
    const Rigid3& linearisation, const VectorXd& step, const Robot& robot) const {
  Linearised all;
  all.camera = At(robot.block);
  all.readout = robot.readout == kNoBlock ? -1 : At(robot.readout);
  const Matrix3d turn = RightJacobianSo3(step.segment<3>(all.camera + 3));
  all.rows.resize(observations.size());
  all.innovation.resize(2 * static_cast<Eigen::Index>(observations.size()));
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Observation& observation = observations[k];
    Linearised::Rows& rows = all.rows[k];
    rows.noise = observation.noise;
    rows.camera = all.camera;
    rows.readout = all.readout;
    rows.d_readout = observation.d_readout;
    Eigen::Vector2d ahead = Eigen::Vector2d::Zero();
    const bool fixed = observation.known_point.has_value();
    const bool of_marker = fixed && observation.marker != 0;
    const auto at =
        of_marker ? LineariseMarker(camera, observation, linearisation, step, rows, ahead)
        : fixed   ? PredictFixed(camera, linearisation, *observation.known_point)
                  : LineariseOne(camera, *Find(observation.id), linearisation, step, rows, ahead);
    if (!at) return NotInView(observation.id);
    rows.d_camera = at->d_camera;
    rows.d_camera.rightCols<3>() = at->d_camera.rightCols<3>() * turn;
    rows.d_clone = at->d_clone;
    rows.d_point = of_marker ? PointColumns(2, 0) : PointColumns(form_->InState(at->d_point));
    if (all.readout >= 0) ahead += rows.d_readout * step[all.readout];
    all.innovation.segment<2>(2 * static_cast<Eigen::Index>(k)) =
        observation.pixel - at->pixel + rows.d_camera * step.segment<6>(all.camera) + ahead;
  }
  return all;
}

std::vector<FilterState::Turned> FilterState::ExplainByTurning(
    const CameraModel& camera, std::span<const Observation> observations,
    const Rigid3& linearisation) const {
  std::map<CloneId, std::vector<TurnResidual>> residuals;
  std::map<CloneId, Turned> turned;
  for (const Observation& observation : observations) {
    if (observation.known_point) continue;
    const Feature& feature = *Find(observation.id);
    const Clone& clone = CloneOf(feature);
    // As first seen: bearings that were corrected since may have taken up some parallax.
    PointFromClone far = Point(feature, true);
    far.world_from_clone = clone.pose;
    far.inverse_range = 0.0;
    const auto at = PredictFromClone(camera, linearisation, far);
    if (!at) continue;
    const Eigen::Matrix2d d_bearing = at->d_point.leftCols<2>();
    residuals[feature.clone].push_back(
        {observation.pixel - at->pixel, at->d_camera.rightCols<3>(),
         observation.noise + d_bearing * feature.birth_covariance * d_bearing.transpose()});
    const int updates = IslandAt(IslandOf(clone.block)).updates;
    turned[feature.clone].age = updates - clone.born;
    turned[feature.clone].ranges.push_back(At(feature.block) + form_->range());
  }
  std::vector<Turned> all;
  for (auto& [id, each] : turned) {
    each.misfit = FitTurn(residuals[id]);
    all.push_back(std::move(each));
  }
  return all;
}

}  // namespace saccade
