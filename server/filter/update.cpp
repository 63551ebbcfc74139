// The part of FilterState that corrects it with matched pixels.
#include <absl/strings/str_cat.h>

#include <Eigen/Cholesky>

#include "server/filter/filter_state.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Sparse measurement model of one frame: two rows an observation, three blocks
/// each.
struct FilterState::Linearised {
  struct Rows {
    Eigen::Matrix<double, 2, 6> d_camera;
    Eigen::Matrix<double, 2, 6> d_anchor;
    Eigen::Matrix<double, 2, 3> d_point;  // last point_dim columns
    int anchor = -1;                      // offset; -1: known point
    int point = -1;
    int point_dim = 0;
    Eigen::Vector2d d_readout;
    Eigen::Matrix2d noise;
  };
  std::vector<Rows> rows;
  VectorXd innovation;
};

absl::StatusOr<FilterState::Linearised> FilterState::LineariseAll(
    const CameraModel& camera, std::span<const Observation> observations,
    const Rigid3& linearisation) const {
  CameraMotion moved = camera_;
  moved.world_from_camera = linearisation;
  const Eigen::Matrix<double, 6, 1> step = Minus(moved, camera_).head<6>();
  const Matrix3d turn = RightJacobianSo3(step.tail<3>());
  Linearised all;
  all.rows.resize(observations.size());
  all.innovation.resize(2 * static_cast<Eigen::Index>(observations.size()));
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Observation& observation = observations[k];
    Linearised::Rows& rows = all.rows[k];
    rows.noise = observation.noise;
    rows.d_readout = observation.d_readout;
    std::optional<PixelPrediction> at;
    if (observation.known_point) {
      at = PredictFixed(camera, linearisation, *observation.known_point);
    } else if (const Feature* feature = Find(observation.id)) {
      at = Linearise(camera, linearisation, *feature);
      rows.anchor = AnchorOf(*feature).offset;
      rows.point = feature->offset;
      rows.point_dim = FeatureDim();
      if (at && rows.point_dim == 1) {
        const Eigen::Matrix2d d_bearing = at->d_point.leftCols<2>();
        rows.noise += d_bearing * feature->frozen_covariance * d_bearing.transpose();
      }
    }
    if (!at) {
      return absl::InvalidArgumentError(
          absl::StrCat("filter: feature ", observation.id, " is unknown or not in view"));
    }
    rows.d_camera = at->d_camera;
    rows.d_camera.rightCols<3>() = at->d_camera.rightCols<3>() * turn;
    rows.d_anchor = at->d_anchor;
    rows.d_point = at->d_point;
    all.innovation.segment<2>(2 * static_cast<Eigen::Index>(k)) =
        observation.pixel - at->pixel + rows.d_camera * step;
  }
  return all;
}

absl::StatusOr<VectorXd> FilterState::KalmanStep(const Linearised& all, UpdateReport& report) {
  const int n = dim();
  const int m = static_cast<int>(all.innovation.size());
  MatrixXd pht(n, m);  // P H^T
  MatrixXd camera_columns(n, kPoseDim), anchor_columns(n, kPoseDim), point_columns(n, 3);
  covariance_.CopyColumns(0, kPoseDim, camera_columns);
  MatrixXd readout_column(n, 1);
  if (readout_offset_ >= 0) covariance_.CopyColumns(readout_offset_, 1, readout_column);
  int copied = -1;  // clones come in runs: ids rise with their features
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    const Linearised::Rows& rows = all.rows[k];
    auto columns = pht.middleCols<2>(2 * static_cast<Eigen::Index>(k));
    columns.noalias() = camera_columns * rows.d_camera.transpose();
    if (readout_offset_ >= 0) columns.noalias() += readout_column * rows.d_readout.transpose();
    if (rows.anchor < 0) continue;
    if (rows.anchor != copied) covariance_.CopyColumns(rows.anchor, kPoseDim, anchor_columns);
    copied = rows.anchor;
    columns.noalias() += anchor_columns * rows.d_anchor.transpose();
    covariance_.CopyColumns(rows.point, rows.point_dim, point_columns.leftCols(rows.point_dim));
    columns.noalias() +=
        point_columns.leftCols(rows.point_dim) * rows.d_point.rightCols(rows.point_dim).transpose();
  }
  MatrixXd s(m, m);
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    const Linearised::Rows& rows = all.rows[k];
    const auto at = 2 * static_cast<Eigen::Index>(k);
    auto block = s.middleRows<2>(at);
    block.noalias() = rows.d_camera * pht.topRows<kPoseDim>();
    if (readout_offset_ >= 0) block.noalias() += rows.d_readout * pht.row(readout_offset_);
    if (rows.anchor >= 0) {
      block.noalias() += rows.d_anchor * pht.middleRows<kPoseDim>(rows.anchor);
      block.noalias() +=
          rows.d_point.rightCols(rows.point_dim) * pht.middleRows(rows.point, rows.point_dim);
    }
    s.block<2, 2>(at, at) += rows.noise;
  }
  const Eigen::LLT<MatrixXd> factor(s);
  if (factor.info() != Eigen::Success) {
    return absl::FailedPreconditionError("filter: innovation covariance not positive definite");
  }
  const VectorXd whitened = factor.matrixL().solve(all.innovation);
  factor.matrixL().transpose().solveInPlace<Eigen::OnTheRight>(pht);
  report.nis = whitened.squaredNorm();
  report.rows = m;
  VectorXd error = pht * whitened;
  if (!error.allFinite()) return absl::FailedPreconditionError("filter: update is not finite");
  covariance_.Downdate(pht);
  return error;
}

absl::StatusOr<VectorXd> FilterState::InformationStep(const Linearised& all, UpdateReport& report) {
  const int n = dim();
  const int m = static_cast<int>(all.innovation.size());
  // P+ = (I + P A)^-1 P with A = sum H_k^T R_k^-1 H_k: P itself need not be
  // invertible.
  MatrixXd h = MatrixXd::Zero(m, n);
  MatrixXd weighted(m, n);
  VectorXd weighted_innovation(m);
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    const Linearised::Rows& rows = all.rows[k];
    const auto at = 2 * static_cast<Eigen::Index>(k);
    h.block<2, kPoseDim>(at, 0) = rows.d_camera;
    if (readout_offset_ >= 0) h.block<2, 1>(at, readout_offset_) = rows.d_readout;
    if (rows.anchor >= 0) {
      h.block<2, kPoseDim>(at, rows.anchor) = rows.d_anchor;
      h.block(at, rows.point, 2, rows.point_dim) = rows.d_point.rightCols(rows.point_dim);
    }
    const Eigen::Matrix2d weight = rows.noise.inverse();
    weighted.middleRows<2>(at) = weight * h.middleRows<2>(at);
    weighted_innovation.segment<2>(at) = weight * all.innovation.segment<2>(at);
  }
  const MatrixXd information = h.transpose() * weighted;
  const MatrixXd prior = covariance_.Full();
  const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd::Identity(n, n) + prior * information);
  const MatrixXd posterior = lu.solve(prior);
  const VectorXd pulled = h.transpose() * weighted_innovation;
  VectorXd error = posterior * pulled;
  if (!error.allFinite() || !posterior.allFinite()) {
    return absl::FailedPreconditionError("filter: update is not finite");
  }
  report.rows = m;
  report.nis = all.innovation.dot(weighted_innovation) - pulled.dot(error);
  covariance_.Assign(0.5 * (posterior + posterior.transpose()));
  return error;
}

absl::StatusOr<UpdateReport> FilterState::Update(const CameraModel& camera,
                                                 std::span<const Observation> observations,
                                                 const Rigid3& linearisation) {
  UpdateReport report;
  if (observations.empty()) return report;
  const auto all = LineariseAll(camera, observations, linearisation);
  if (!all.ok()) return all.status();
  VectorXd ahead = VectorXd::Zero(dim());  // where it was linearised, from the prediction
  ahead.segment<3>(0) = linearisation.translation - camera_.world_from_camera.translation;
  ++updates_;
  CarryScale(ahead);
  const bool information = static_cast<int>(all->innovation.size()) > dim();
  const auto error = information ? InformationStep(*all, report) : KalmanStep(*all, report);
  if (!error.ok()) return error.status();
  first_pose_ = linearisation;
  CarryScale(*error - ahead);
  Correct(*error);
  return report;
}

void FilterState::CarryScale(const VectorXd& step) {
  if (updates_ <= options_.carry_scale_after) return;
  const int last = FeatureDim() - 1;
  VectorXd w = VectorXd::Zero(dim());
  VectorXd d = VectorXd::Zero(dim());
  double total = 0.0;
  for (const Feature& feature : features_) {
    const int at = feature.offset + last;
    const double rho = feature.inverse_range;
    if (rho < options_.min_inverse_range) continue;
    // Weight by information; w^T N = 1 for the scale direction N = (positions,
    // -rho).
    const double information = rho * rho / std::max(covariance_.at(at, at), 1e-12);
    w[at] = -information / rho;
    total += information;
    d[at] = -step[at];
  }
  if (total <= 0.0) return;
  w /= total;
  d.segment<3>(0) = step.segment<3>(0);
  d.segment<3>(6) = step.segment<3>(6);
  if (!options_.fej) {
    for (const Anchor& anchor : anchors_) {
      d.segment<3>(anchor.offset) = step.segment<3>(anchor.offset);
    }
  }
  covariance_.TransformRankOne(d, w);
}

void FilterState::Correct(const VectorXd& error) {
  // P is in the tangent space before the correction; G = Jr(d) carries it to
  // the one after.
  constexpr double kNegligible_rad = 1e-9;
  const auto carry = [&](int offset) {
    const Eigen::Vector3d turned = error.segment<3>(offset);
    if (turned.squaredNorm() < kNegligible_rad * kNegligible_rad) return;
    covariance_.TransformBlock(offset, RightJacobianSo3(turned));
  };
  camera_ = Plus(camera_, error.head<kCameraDim>());
  carry(3);
  if (readout_offset_ >= 0) readout_s_ += error[readout_offset_];
  for (Anchor& anchor : anchors_) {
    anchor.pose.translation += error.segment<3>(anchor.offset);
    anchor.pose.rotation =
        (anchor.pose.rotation * ExpQuaternion(error.segment<3>(anchor.offset + 3))).normalized();
    carry(anchor.offset + 3);
  }
  const bool with_bearing = FeatureDim() == 3;
  for (Feature& feature : features_) {
    const auto part = error.segment(feature.offset, FeatureDim());
    if (with_bearing) MoveBearing(part.head<2>(), feature.bearing, feature.basis);
    feature.inverse_range += part[part.size() - 1];
  }
}

}  // namespace saccade
