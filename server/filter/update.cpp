// The part of FilterState that corrects it with matched pixels.
#include <absl/strings/str_cat.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>

#include "server/filter/filter_state.hpp"
#include "server/filter/parallax.hpp"

namespace saccade {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kYoung = 150;  // updates: every hint of depth is needed, and all may be wrong

/// A read-out time is a constant of the camera: a frame that would move it by more than two of its
/// sigmas is wrong about something else; a young map as a whole may be. `before`: covariance whose
/// last row is the read-out's.
bool Sudden(double error_s, const MatrixXd& before) {
  constexpr double kSigmas = 2.0;
  const double variance = before(before.rows() - 1, before.cols() - 1);
  return error_s * error_s > kSigmas * kSigmas * variance;
}

Rigid3 Moved(const Rigid3& pose, const Eigen::Matrix<double, 6, 1>& error) {
  return {(pose.rotation * ExpQuaternion(error.tail<3>())).normalized(),
          pose.translation + error.head<3>()};
}

}  // namespace

/// Sparse measurement model of one frame: two rows an observation, three blocks
/// each.
struct FilterState::Linearised {
  struct Rows : Journal::Updated::Rows {
    Eigen::Matrix2d noise;
  };
  std::vector<Rows> rows;
  VectorXd innovation;
};

VectorXd FilterState::StepTo(const Rigid3& linearisation) const {
  CameraMotion moved = camera_;
  moved.world_from_camera = linearisation;
  const Eigen::Matrix<double, 6, 1> of_camera = Minus(moved, camera_).head<6>();
  VectorXd step = VectorXd::Zero(dim());
  const Eigen::LDLT<Matrix6d> factor(PoseCovariance());
  if (factor.info() == Eigen::Success && factor.vectorD().minCoeff() > 0.0) {
    MatrixXd columns(dim(), kPoseDim);
    covariance_.CopyColumns(0, kPoseDim, columns);
    step = columns * factor.solve(of_camera);
    if (!step.allFinite()) step.setZero();
  }
  step.head<6>() = of_camera;
  return step;
}

AnchoredPoint FilterState::MovedPoint(const Feature& feature, const VectorXd& step) const {
  const Anchor& anchor = AnchorOf(feature);
  PointInClone point = feature.point;
  form_->Move(step.segment(feature.offset, form_->dim()), point);
  return {Moved(anchor.pose, step.segment<6>(anchor.offset)), point.bearing, point.basis,
          point.inverse_range};
}

absl::StatusOr<FilterState::Linearised> FilterState::LineariseAll(
    const CameraModel& camera, std::span<const Observation> observations,
    const Rigid3& linearisation, const VectorXd& step) const {
  const Matrix3d turn = RightJacobianSo3(step.segment<3>(3));
  Linearised all;
  all.rows.resize(observations.size());
  all.innovation.resize(2 * static_cast<Eigen::Index>(observations.size()));
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Observation& observation = observations[k];
    Linearised::Rows& rows = all.rows[k];
    rows.noise = observation.noise;
    rows.readout = readout_offset_;
    rows.d_readout = observation.d_readout;
    std::optional<PixelPrediction> at;
    Eigen::Vector2d ahead = Eigen::Vector2d::Zero();
    if (observation.known_point) {
      at = PredictFixed(camera, linearisation, *observation.known_point);
    } else if (const Feature* feature = Find(observation.id)) {
      at = PredictAnchored(camera, linearisation, MovedPoint(*feature, step));
      if (at && Fej()) {
        if (const auto first = PredictAnchored(camera, linearisation, Point(*feature, true))) {
          at->d_camera = first->d_camera;
          at->d_anchor = first->d_anchor;
          at->d_point = first->d_point;
        }
      }
      rows.anchor = AnchorOf(*feature).offset;
      rows.point = feature->offset;
      if (at) {
        if (!Fej()) {
          at->d_anchor.rightCols<3>() *= RightJacobianSo3(step.segment<3>(rows.anchor + 3)).eval();
        }
        ahead = at->d_anchor * step.segment<6>(rows.anchor) +
                form_->InState(at->d_point) * step.segment(rows.point, form_->dim());
        const Eigen::Matrix2d d_bearing = at->d_point.leftCols<2>();
        rows.noise += d_bearing * form_->Frozen(feature->birth_covariance) * d_bearing.transpose();
      }
    }
    if (!at) {
      return absl::InvalidArgumentError(
          absl::StrCat("filter: feature ", observation.id, " is unknown or not in view"));
    }
    rows.d_camera = at->d_camera;
    rows.d_camera.rightCols<3>() = at->d_camera.rightCols<3>() * turn;
    rows.d_anchor = at->d_anchor;
    rows.d_point = form_->InState(at->d_point);
    if (readout_offset_ >= 0) ahead += rows.d_readout * step[readout_offset_];
    all.innovation.segment<2>(2 * static_cast<Eigen::Index>(k)) =
        observation.pixel - at->pixel + rows.d_camera * step.head<6>() + ahead;
  }
  return all;
}

std::vector<FilterState::Turned> FilterState::ExplainByTurning(
    const CameraModel& camera, std::span<const Observation> observations,
    const Rigid3& linearisation) const {
  std::map<AnchorPoseId, std::vector<TurnResidual>> residuals;
  std::map<AnchorPoseId, Turned> turned;
  for (const Observation& observation : observations) {
    if (observation.known_point) continue;
    const Feature& feature = *Find(observation.id);
    // As first seen: bearings that were corrected since may have taken up some parallax.
    AnchoredPoint far = Point(feature, true);
    far.world_from_anchor = AnchorOf(feature).pose;
    far.inverse_range = 0.0;
    const auto at = PredictAnchored(camera, linearisation, far);
    if (!at) continue;
    const Eigen::Matrix2d d_bearing = at->d_point.leftCols<2>();
    residuals[feature.anchor].push_back(
        {observation.pixel - at->pixel, at->d_camera.rightCols<3>(),
         observation.noise + d_bearing * feature.birth_covariance * d_bearing.transpose()});
    turned[feature.anchor].age = updates_ - AnchorOf(feature).born;
    turned[feature.anchor].ranges.push_back(feature.offset + form_->range());
  }
  std::vector<Turned> all;
  for (auto& [anchor, each] : turned) {
    each.misfit = FitTurn(residuals[anchor]);
    all.push_back(std::move(each));
  }
  return all;
}

absl::StatusOr<VectorXd> FilterState::KalmanStep(const Linearised& all, UpdateReport& report,
                                                 Journal::Updated& record) {
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
    covariance_.CopyColumns(rows.point, form_->dim(), point_columns.leftCols(form_->dim()));
    columns.noalias() += point_columns.leftCols(form_->dim()) * rows.d_point.transpose();
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
      block.noalias() += rows.d_point * pht.middleRows(rows.point, form_->dim());
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
  if (mark_) {
    record.gain = std::move(pht);
    record.factor = factor.matrixL();
  }
  return error;
}

absl::StatusOr<VectorXd> FilterState::InformationStep(const Linearised& all, UpdateReport& report,
                                                      Journal::Updated& record) {
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
      h.block(at, rows.point, 2, form_->dim()) = rows.d_point;
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
  if (mark_) record.gain.noalias() = posterior * weighted.transpose();
  return error;
}

void FilterState::JudgeNoise(const UpdateReport& report) {
  // R is set with a margin; parallax is judged by how large the matches' errors really are.
  constexpr double kMemory = 30.0;  // updates
  constexpr double kLeastScale = 0.05;
  constexpr int kFewestRows = 20;
  if (report.rows < kFewestRows) return;
  // The camera's own six numbers hardly surprise: they take no part.
  const double seen = std::clamp(report.nis / (report.rows - kPoseDim), kLeastScale, 1.0);
  noise_scale_ += (seen - noise_scale_) / std::min<double>(kMemory, ++judged_);
}

VectorXd FilterState::KeptShares(const std::vector<Turned>& turned) const {
  constexpr double kDoubling = 10.0;  // updates
  // However good matches are: a patch seen from elsewhere is off by 0.3 px and more, and always the
  // same way. A young map needs every hint of depth.
  constexpr double kBias = 0.5;  // of R
  const double noise_scale = std::max(noise_scale_, updates_ > kYoung ? kBias : 0.0);
  std::vector<double> kept;
  for (const Turned& each : turned) {
    // The errors at birth are the same in every frame: what is unlikely once is not for long.
    const double sigmas = options_.parallax_sigmas + std::log2(1.0 + each.age / kDoubling);
    const double share = each.misfit.Evidence(sigmas, noise_scale);
    kept.insert(kept.end(), each.ranges.size(), 1.0 - share);
  }
  return Eigen::Map<VectorXd>(kept.data(), std::ssize(kept));
}

absl::StatusOr<UpdateReport> FilterState::Update(const CameraModel& camera,
                                                 std::span<const Observation> observations,
                                                 const Rigid3& linearisation) {
  UpdateReport report;
  if (observations.empty()) return report;
  const VectorXd ahead = StepTo(linearisation);
  const auto all = LineariseAll(camera, observations, linearisation, ahead);
  if (!all.ok()) return all.status();
  ++updates_;
  CarryScale(ahead);
  std::vector<Turned> turned;
  if (options_.parallax_sigmas > 0.0)
    turned = ExplainByTurning(camera, observations, linearisation);
  std::vector<int> ranges;
  for (const Turned& each : turned) {
    ranges.insert(ranges.end(), each.ranges.begin(), each.ranges.end());
  }
  if (readout_offset_ >= 0) ranges.push_back(readout_offset_);  // the last
  const MatrixXd before = covariance_.Among(ranges);
  const bool information = static_cast<int>(all->innovation.size()) > dim();
  Journal::Updated record;
  auto error =
      information ? InformationStep(*all, report, record) : KalmanStep(*all, report, record);
  if (!error.ok()) return error.status();
  JudgeNoise(report);
  // Partial update (docs/derivations/parallax.md): inverse ranges take only a share of their gain.
  VectorXd kept = KeptShares(turned);
  if (readout_offset_ >= 0) {
    kept.conservativeResize(kept.size() + 1);
    const bool sudden = updates_ > kYoung && Sudden((*error)[readout_offset_], before);
    kept.tail<1>()[0] = sudden ? 1.0 : 0.0;
  }
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    const double taken = 1.0 - kept[static_cast<Eigen::Index>(k)];
    (*error)[ranges[k]] *= taken;
    if (mark_) record.gain.row(ranges[k]) *= taken;
  }
  if (mark_) {
    record.rows.assign(all->rows.begin(), all->rows.end());
    mark_->journal.Add(std::move(record));
  }
  covariance_.Blend(ranges, before, kept * kept.transpose());
  first_pose_ = linearisation;
  CarryScale(*error - ahead);
  Correct(*error);
  return report;
}

void FilterState::CarryScale(const VectorXd& step) {
  if (updates_ <= options_.carry_scale_after) return;
  VectorXd w = VectorXd::Zero(dim());
  VectorXd d = VectorXd::Zero(dim());
  double total = 0.0;
  for (const Feature& feature : features_) {
    const int at = feature.offset + form_->range();
    const double rho = feature.point.inverse_range;
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
  d.head(motion_->dim()) = motion_->OfScale(step.head(motion_->dim()));
  if (!Fej()) {
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
  camera_ = motion_->Plus(camera_, error.head(motion_->dim()));
  carry(3);
  if (readout_offset_ >= 0) readout_s_ += error[readout_offset_];
  for (Anchor& anchor : anchors_) {
    anchor.pose = Moved(anchor.pose, error.segment<6>(anchor.offset));
    carry(anchor.offset + 3);
  }
  for (Feature& feature : features_) {
    form_->Move(error.segment(feature.offset, form_->dim()), feature.point);
  }
}

}  // namespace saccade
