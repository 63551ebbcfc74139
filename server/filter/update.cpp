// The part of FilterState that corrects it with matched pixels.
#include <Eigen/Cholesky>
#include <algorithm>

#include "server/filter/filter_state.hpp"
#include "server/filter/parallax.hpp"

namespace saccade {

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

}  // namespace

absl::StatusOr<VectorXd> FilterState::KalmanStep(const Linearised& all, Island& island,
                                                 UpdateReport& report, Journal::Updated& record) {
  Covariance& p = island.p;
  const int n = p.dim();
  const int m = static_cast<int>(all.innovation.size());
  MatrixXd pht(n, m);  // P H^T
  MatrixXd camera_columns(n, kPoseDim), clone_columns(n, kPoseDim), point_columns(n, 3);
  p.CopyColumns(all.camera, kPoseDim, camera_columns);
  MatrixXd readout_column(n, 1);
  if (all.readout >= 0) p.CopyColumns(all.readout, 1, readout_column);
  int copied = -1;  // clones come in runs: ids rise with their features
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    const Linearised::Rows& rows = all.rows[k];
    auto columns = pht.middleCols<2>(2 * static_cast<Eigen::Index>(k));
    columns.noalias() = camera_columns * rows.d_camera.transpose();
    if (all.readout >= 0) columns.noalias() += readout_column * rows.d_readout.transpose();
    if (rows.clone < 0) continue;
    if (rows.clone != copied) p.CopyColumns(rows.clone, kPoseDim, clone_columns);
    copied = rows.clone;
    columns.noalias() += clone_columns * rows.d_clone.transpose();
    const int size = static_cast<int>(rows.d_point.cols());
    p.CopyColumns(rows.point, size, point_columns.leftCols(size));
    columns.noalias() += point_columns.leftCols(size) * rows.d_point.transpose();
  }
  MatrixXd s(m, m);
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    const Linearised::Rows& rows = all.rows[k];
    const auto at = 2 * static_cast<Eigen::Index>(k);
    auto block = s.middleRows<2>(at);
    block.noalias() = rows.d_camera * pht.middleRows<kPoseDim>(all.camera);
    if (all.readout >= 0) block.noalias() += rows.d_readout * pht.row(all.readout);
    if (rows.clone >= 0) {
      block.noalias() += rows.d_clone * pht.middleRows<kPoseDim>(rows.clone);
      block.noalias() += rows.d_point * pht.middleRows(rows.point, rows.d_point.cols());
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
  p.Downdate(pht);
  if (island.checkpoint) {
    record.gain = std::move(pht);
    record.factor = factor.matrixL();
  }
  return error;
}

absl::StatusOr<VectorXd> FilterState::InformationStep(const Linearised& all, Island& island,
                                                      UpdateReport& report,
                                                      Journal::Updated& record) {
  Covariance& p = island.p;
  const int n = p.dim();
  const int m = static_cast<int>(all.innovation.size());
  // P+ = (I + P A)^-1 P with A = sum H_k^T R_k^-1 H_k: P itself need not be invertible.
  MatrixXd h = MatrixXd::Zero(m, n);
  MatrixXd weighted(m, n);
  VectorXd weighted_innovation(m);
  for (std::size_t k = 0; k < all.rows.size(); ++k) {
    const Linearised::Rows& rows = all.rows[k];
    const auto at = 2 * static_cast<Eigen::Index>(k);
    h.block<2, kPoseDim>(at, all.camera) = rows.d_camera;
    if (all.readout >= 0) h.block<2, 1>(at, all.readout) = rows.d_readout;
    if (rows.clone >= 0) {
      h.block<2, kPoseDim>(at, rows.clone) = rows.d_clone;
      h.block(at, rows.point, 2, rows.d_point.cols()) = rows.d_point;
    }
    const Eigen::Matrix2d weight = rows.noise.inverse();
    weighted.middleRows<2>(at) = weight * h.middleRows<2>(at);
    weighted_innovation.segment<2>(at) = weight * all.innovation.segment<2>(at);
  }
  const MatrixXd information = h.transpose() * weighted;
  const MatrixXd prior = p.Full();
  const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd::Identity(n, n) + prior * information);
  const MatrixXd posterior = lu.solve(prior);
  const VectorXd pulled = h.transpose() * weighted_innovation;
  VectorXd error = posterior * pulled;
  if (!error.allFinite() || !posterior.allFinite()) {
    return absl::FailedPreconditionError("filter: update is not finite");
  }
  report.rows = m;
  report.nis = all.innovation.dot(weighted_innovation) - pulled.dot(error);
  p.Assign(0.5 * (posterior + posterior.transpose()));
  if (island.checkpoint) record.gain.noalias() = posterior * weighted.transpose();
  return error;
}

void FilterState::JudgeNoise(const UpdateReport& report, Robot& robot) {
  // R is set with a margin; parallax is judged by how large the matches' errors really are.
  constexpr double kMemory = 30.0;  // updates
  constexpr double kLeastScale = 0.05;
  constexpr int kFewestRows = 20;
  if (report.rows < kFewestRows) return;
  // The camera's own six numbers hardly surprise: they take no part.
  const double seen = std::clamp(report.nis / (report.rows - kPoseDim), kLeastScale, 1.0);
  robot.noise_scale += (seen - robot.noise_scale) / std::min<double>(kMemory, ++robot.judged);
}

VectorXd FilterState::KeptShares(const std::vector<Turned>& turned, const Robot& robot) const {
  constexpr double kDoubling = 10.0;  // updates
  // However good matches are: a patch seen from elsewhere is off by 0.3 px and more, and always the
  // same way. A young map needs every hint of depth.
  constexpr double kBias = 0.5;  // of R
  const int updates = IslandAt(IslandOf(robot.block)).updates;
  const double noise_scale = std::max(robot.noise_scale, updates > kYoung ? kBias : 0.0);
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
                                                 const Rigid3& linearisation, RobotId id) {
  UpdateReport report;
  if (observations.empty()) return report;
  if (const absl::Status status = JoinSeen(observations, id); !status.ok()) return status;
  Robot& robot = Of(id);
  const int number = IslandOf(robot.block);
  Island& island = IslandAt(number);
  const VectorXd ahead = StepTo(linearisation, robot);
  const auto all = LineariseAll(camera, observations, linearisation, ahead, robot);
  if (!all.ok()) return all.status();
  ++island.updates;
  CarryScale(ahead, number);
  std::vector<Turned> turned;
  if (options_.parallax_sigmas > 0.0)
    turned = ExplainByTurning(camera, observations, linearisation);
  std::vector<int> ranges;
  for (const Turned& each : turned) {
    ranges.insert(ranges.end(), each.ranges.begin(), each.ranges.end());
  }
  if (all->readout >= 0) ranges.push_back(all->readout);  // the last
  const MatrixXd before = island.p.Among(ranges);
  const bool information = static_cast<int>(all->innovation.size()) > island.p.dim();
  Journal::Updated record;
  auto error = information ? InformationStep(*all, island, report, record)
                           : KalmanStep(*all, island, report, record);
  if (!error.ok()) return error.status();
  JudgeNoise(report, robot);
  // Partial update (docs/derivations/parallax.md): inverse ranges take only a share of their gain.
  VectorXd kept = KeptShares(turned, robot);
  if (all->readout >= 0) {
    kept.conservativeResize(kept.size() + 1);
    const bool sudden = island.updates > kYoung && Sudden((*error)[all->readout], before);
    kept.tail<1>()[0] = sudden ? 1.0 : 0.0;
  }
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    const double taken = 1.0 - kept[static_cast<Eigen::Index>(k)];
    (*error)[ranges[k]] *= taken;
    if (island.checkpoint) record.gain.row(ranges[k]) *= taken;
  }
  if (island.checkpoint) {
    record.rows.assign(all->rows.begin(), all->rows.end());
    island.checkpoint->journal.Add(std::move(record));
  }
  island.p.Blend(ranges, before, kept * kept.transpose());
  robot.first_pose = linearisation;
  CarryScale(*error - ahead, number);
  Correct(*error, number);
  return report;
}

}  // namespace saccade
