// The part of FilterState that corrects it with matched pixels.
#include <absl/strings/str_cat.h>

#include <Eigen/Cholesky>
#include <map>

#include "server/filter/filter_state.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSignificant = 4.0;  // standard deviations that a baseline must exceed

}  // namespace

/// Sparse measurement model of one frame: two rows an observation, three blocks each.
struct FilterState::Linearised {
  struct Rows {
    Eigen::Matrix<double, 2, 6> d_camera;
    Eigen::Matrix<double, 2, 6> d_anchor;
    Eigen::Matrix<double, 2, 3> d_point;  // last point_dim columns
    int anchor = -1;                      // offset; -1: known point
    int point = -1;
    int point_dim = 0;
    Eigen::Matrix2d noise;
  };
  std::vector<Rows> rows;
  VectorXd innovation;
};

double FilterState::BaselineVariance(int anchor_offset, const Matrix6d& pose_covariance,
                                     const Eigen::LLT<Matrix6d>& prior) const {
  // Given the camera's pose error c, the anchor's is A c + rest, A = P_ac P_cc^-1.
  const Matrix6d cross = covariance_.Block(anchor_offset, 0, kPoseDim, kPoseDim);
  const Matrix6d along = prior.solve(cross.transpose()).transpose();
  const Matrix6d rest = covariance_.Block(anchor_offset, anchor_offset, kPoseDim, kPoseDim) -
                        along * cross.transpose();
  Matrix6d apart = Matrix6d::Identity() - along;
  const Matrix6d relative = apart * pose_covariance * apart.transpose() + rest;
  return std::max(0.0, relative.topLeftCorner<3, 3>().trace() / 3.0);
}

absl::StatusOr<FilterState::Linearised> FilterState::LineariseAll(
    const CameraModel& camera, std::span<const Observation> observations,
    const Rigid3& linearisation, const VectorXd& ahead, const Matrix6d* pose_covariance) const {
  CameraMotion moved = camera_;
  moved.world_from_camera = linearisation;
  const Eigen::Matrix<double, 6, 1> step = Minus(moved, camera_).head<6>();
  const Matrix3d turn = RightJacobianSo3(step.tail<3>());
  const Eigen::LLT<Matrix6d> prior(PoseCovariance());
  std::map<int, double> variances;  // by anchor
  Linearised all;
  all.rows.resize(observations.size());
  all.innovation.resize(2 * static_cast<Eigen::Index>(observations.size()));
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Observation& observation = observations[k];
    Linearised::Rows& rows = all.rows[k];
    rows.noise = observation.noise;
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
    if (pose_covariance != nullptr && rows.anchor >= 0) {
      const auto [known, fresh] = variances.try_emplace(rows.anchor, 0.0);
      if (fresh) known->second = BaselineVariance(rows.anchor, *pose_covariance, prior);
      const Eigen::Vector3d baseline =
          AnchorOf(*Find(observation.id)).pose.translation - linearisation.translation;
      const Eigen::Vector3d ray = (linearisation.rotation * at->ray).normalized();
      const double across = (baseline - ray * ray.dot(baseline)).squaredNorm();
      const double noise = kSignificant * kSignificant * known->second;
      rows.d_point.col(2) *= across > noise ? 1.0 - noise / across : 0.0;
    }
    all.innovation.segment<2>(2 * static_cast<Eigen::Index>(k)) =
        observation.pixel - at->pixel + rows.d_camera * step;
    if (rows.point >= 0) {
      all.innovation.segment<2>(2 * static_cast<Eigen::Index>(k)) +=
          rows.d_point.rightCols(rows.point_dim) * ahead.segment(rows.point, rows.point_dim);
    }
  }
  return all;
}

absl::StatusOr<VectorXd> FilterState::KalmanStep(const Linearised& all, bool final,
                                                 UpdateReport& report) {
  const int n = dim();
  const int m = static_cast<int>(all.innovation.size());
  MatrixXd pht(n, m);  // P H^T
  MatrixXd camera_columns(n, kPoseDim), anchor_columns(n, kPoseDim), point_columns(n, 3);
  covariance_.CopyColumns(0, kPoseDim, camera_columns);
  int copied = -1;  // clones come in runs: ids rise with their features
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    const Linearised::Rows& rows = all.rows[k];
    auto columns = pht.middleCols<2>(2 * static_cast<Eigen::Index>(k));
    columns.noalias() = camera_columns * rows.d_camera.transpose();
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
  if (final) covariance_.Downdate(pht);
  return error;
}

absl::StatusOr<VectorXd> FilterState::InformationStep(const Linearised& all, UpdateReport& report) {
  const int n = dim();
  const int m = static_cast<int>(all.innovation.size());
  // P+ = (I + P A)^-1 P with A = sum H_k^T R_k^-1 H_k: P itself need not be invertible.
  MatrixXd h = MatrixXd::Zero(m, n);
  MatrixXd weighted(m, n);
  VectorXd weighted_innovation(m);
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    const Linearised::Rows& rows = all.rows[k];
    const auto at = 2 * static_cast<Eigen::Index>(k);
    h.block<2, kPoseDim>(at, 0) = rows.d_camera;
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
                                                 const Rigid3& linearisation, int iterations,
                                                 const Matrix6d* pose_covariance) {
  UpdateReport report;
  if (observations.empty()) return report;
  const std::vector<Feature> before = features_;
  VectorXd ahead = VectorXd::Zero(dim());  // where to linearise, from the prediction
  Rigid3 at = linearisation;
  for (int k = 1;; ++k) {
    CameraMotion there = camera_;
    there.world_from_camera = at;
    ahead.head<kPoseDim>() = Minus(there, camera_).head<kPoseDim>();
    const bool final = k >= iterations;
    const auto all = LineariseAll(camera, observations, at, ahead, pose_covariance);
    if (!all.ok()) return Undo(before, all.status());
    const bool information = static_cast<int>(all->innovation.size()) > dim();
    if (final) {
      features_ = before;
      CarryScale(ahead);
    }
    const auto error =
        information && final ? InformationStep(*all, report) : KalmanStep(*all, final, report);
    if (!error.ok()) return Undo(before, error.status());
    if (final) {
      first_pose_ = at;
      MoveFeatures(ahead);
      CarryScale(*error - ahead);
      features_ = before;
      Correct(*error);
      return report;
    }
    ahead = *error;
    at = Plus(camera_, error->head<kCameraDim>()).world_from_camera;
    features_ = before;
    MoveFeatures(ahead);
  }
}

absl::Status FilterState::Undo(const std::vector<Feature>& before, const absl::Status& status) {
  features_ = before;
  return status;
}

void FilterState::MoveFeatures(const VectorXd& step) {
  const bool with_bearing = FeatureDim() == 3;
  for (Feature& feature : features_) {
    const auto part = step.segment(feature.offset, FeatureDim());
    if (with_bearing) MoveBearing(part.head<2>(), feature.bearing, feature.basis);
    feature.inverse_range += part[part.size() - 1];
  }
}

void FilterState::CarryScale(const VectorXd& step) {
  const int last = FeatureDim() - 1;
  VectorXd w = VectorXd::Zero(dim());
  VectorXd d = VectorXd::Zero(dim());
  double total = 0.0;
  for (const Feature& feature : features_) {
    const int at = feature.offset + last;
    const double rho = feature.inverse_range;
    if (rho < options_.min_inverse_range) continue;
    // Weight by information; w^T N = 1 for the scale direction N = (positions, -rho).
    const double information = rho * rho / std::max(covariance_.at(at, at), 1e-12);
    w[at] = -information / rho;
    total += information;
  }
  if (total <= 0.0) return;
  w /= total;
  d.segment<3>(0) = step.segment<3>(0);
  d.segment<3>(6) = step.segment<3>(6);
  if (!options_.fej) {
    for (const Anchor& anchor : anchors_)
      d.segment<3>(anchor.offset) = step.segment<3>(anchor.offset);
  }
  for (const Feature& feature : features_) {
    const int at = feature.offset + last;
    if (w[at] != 0.0) d[at] = -step[at];
  }
  covariance_.TransformRankOne(d, w);
}

void FilterState::Correct(const VectorXd& error) {
  // P is in the tangent space before the correction; G = Jr(d) carries it to the one after.
  constexpr double kNegligible_rad = 1e-9;
  const auto carry = [&](int offset) {
    const Eigen::Vector3d turned = error.segment<3>(offset);
    if (turned.squaredNorm() < kNegligible_rad * kNegligible_rad) return;
    covariance_.TransformBlock(offset, RightJacobianSo3(turned));
  };
  camera_ = Plus(camera_, error.head<kCameraDim>());
  carry(3);
  for (Anchor& anchor : anchors_) {
    anchor.pose.translation += error.segment<3>(anchor.offset);
    anchor.pose.rotation =
        (anchor.pose.rotation * ExpQuaternion(error.segment<3>(anchor.offset + 3))).normalized();
    carry(anchor.offset + 3);
  }
  MoveFeatures(error);
}

}  // namespace saccade
