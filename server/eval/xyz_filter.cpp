#include "server/eval/xyz_filter.hpp"

#include <absl/strings/str_cat.h>

namespace saccade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kCamera = 12;
constexpr double kRangeSigma = 0.1;    // of the range
constexpr std::size_t kMeasured = 25;  // a frame, as in a real run of modest cost
constexpr std::size_t kMaxFeatures = 120;
constexpr std::size_t kBirths = 15;
constexpr std::size_t kEnough = 20;
constexpr std::size_t kWorthAClone = 6;

Matrix12d StartCovariance() {
  Vector12d sigma;
  sigma << Vector3d::Constant(0.01), Vector3d::Constant(0.01), Vector3d::Constant(0.05),
      Vector3d::Constant(0.05);
  return sigma.cwiseAbs2().asDiagonal();
}

CameraMotion TrueMotion(const PointsFrame& frame) {
  return {frame.world_from_camera, frame.velocity_in_world, frame.angular_velocity_in_camera, {}};
}

}  // namespace

XyzFilter::XyzFilter(const PointsWorld& world, const PointsOptions& options)
    : world_(world), options_(options), random_(options.seed ^ 0x5acadeULL) {
  std::normal_distribution<double> normal;
  p_ = StartCovariance();
  Vector12d error;
  for (int i = 0; i < kCamera; ++i) error[i] = std::sqrt(p_(i, i)) * normal(random_);
  camera_ = Plus(TrueMotion(world.frames.front()), error);
}

Vector3d XyzFilter::PlaceOf(const Row& row) const {
  return row.offset < 0 ? row.known : Vector3d(points_.segment<3>(row.offset - kCamera));
}

std::vector<XyzFilter::Row> XyzFilter::Match(const PointsFrame& frame) const {
  std::vector<Row> rows;
  for (const PointObservation& seen : frame.observations) {
    if (rows.size() == kMeasured) break;
    Row row;
    row.pixel = seen.pixel;
    if (seen.point < options_.target_points) {
      row.known = world_.points[static_cast<std::size_t>(seen.point)];
    } else if (const auto at = offset_of_point_.find(seen.point); at != offset_of_point_.end()) {
      row.offset = at->second;
    } else {
      continue;
    }
    if (PredictFixed(world_.camera, camera_.world_from_camera, PlaceOf(row))) {
      rows.push_back(row);
    }
  }
  return rows;
}

absl::Status XyzFilter::Update(const std::vector<Row>& rows) {
  const auto n = p_.rows(), m = 2 * std::ssize(rows);
  MatrixXd pht(n, m), h = MatrixXd::Zero(m, n);
  VectorXd innovation(m);
  for (Eigen::Index k = 0; k < std::ssize(rows); ++k) {
    const Row& row = rows[static_cast<std::size_t>(k)];
    const auto at = PredictFixed(world_.camera, camera_.world_from_camera, PlaceOf(row));
    h.block<2, 6>(2 * k, 0) = at->d_camera;
    innovation.segment<2>(2 * k) = row.pixel - at->pixel;
    pht.middleCols<2>(2 * k) = p_.leftCols<6>() * at->d_camera.transpose();
    if (row.offset < 0) continue;
    h.block<2, 3>(2 * k, row.offset) = -at->d_camera.leftCols<3>();
    pht.middleCols<2>(2 * k) -=
        p_.middleCols<3>(row.offset) * at->d_camera.leftCols<3>().transpose();
  }
  MatrixXd s = h * pht;
  s.diagonal().array() += options_.noise_px * options_.noise_px;
  const Eigen::LLT<MatrixXd> factor(s);
  if (factor.info() != Eigen::Success) return absl::FailedPreconditionError("xyz: S is singular");
  const VectorXd step = pht * factor.solve(innovation);
  if (!step.allFinite()) return absl::FailedPreconditionError("xyz: not a number");
  const MatrixXd w = factor.matrixL().solve(pht.transpose());
  p_ -= w.transpose() * w;
  camera_ = Plus(camera_, step.head<kCamera>());
  points_ += step.tail(n - kCamera);
  const Eigen::Matrix3d carry = RightJacobianSo3(step.segment<3>(3));
  p_.middleRows<3>(3) = (carry * p_.middleRows<3>(3)).eval();
  p_.middleCols<3>(3) = (p_.middleCols<3>(3) * carry.transpose()).eval();
  p_ = (0.5 * (p_ + p_.transpose())).eval();
  return absl::OkStatus();
}

void XyzFilter::Birth(const PointsFrame& frame, std::size_t matched) {
  if (matched >= kEnough) return;
  std::vector<const PointObservation*> fresh;
  for (const PointObservation& seen : frame.observations) {
    if (fresh.size() == kBirths || offset_of_point_.size() + fresh.size() >= kMaxFeatures) break;
    if (seen.point >= options_.target_points && !offset_of_point_.contains(seen.point)) {
      fresh.push_back(&seen);
    }
  }
  if (fresh.size() < kWorthAClone) return;
  std::normal_distribution<double> normal;
  const Rigid3& pose = camera_.world_from_camera;
  const Eigen::Matrix3d r = pose.RotationMatrix();
  for (const PointObservation* seen : fresh) {
    Eigen::Matrix<double, 3, 2> d_bearing;
    const auto bearing = world_.camera.Unproject(seen->pixel, &d_bearing);
    if (!bearing) continue;
    const double truth =
        (frame.world_from_camera.Inverse() * world_.points[static_cast<std::size_t>(seen->point)])
            .norm();
    const double range = truth * std::max(0.3, 1.0 + kRangeSigma * normal(random_));
    const Vector3d in_camera = range * *bearing;
    Eigen::Matrix<double, 3, 6> by_pose;
    by_pose << Eigen::Matrix3d::Identity(), -r * Skew(in_camera);
    const Eigen::Matrix<double, 3, 2> by_pixel = range * options_.noise_px * r * d_bearing;
    const Vector3d by_range = kRangeSigma * range * (r * *bearing);
    const auto n = p_.rows();
    const MatrixXd across = by_pose * p_.topRows<6>();
    const Eigen::Matrix<double, 3, 6> with_pose = across.leftCols<6>();
    Eigen::Matrix3d own = with_pose * by_pose.transpose();
    own += by_pixel * by_pixel.transpose();
    own += by_range * by_range.transpose();
    p_.conservativeResize(n + 3, n + 3);
    p_.bottomLeftCorner(3, n) = across;
    p_.topRightCorner(n, 3) = across.transpose();
    p_.bottomRightCorner<3, 3>() = own;
    points_.conservativeResize(points_.size() + 3);
    points_.tail<3>() = pose * in_camera;
    offset_of_point_[seen->point] = static_cast<int>(n);
  }
}

absl::StatusOr<PointsStep> XyzFilter::Step(std::size_t index) {
  const PointsFrame& frame = world_.frames[index];
  if (index > 0) {
    const MotionJacobians j =
        LineariseMotion(camera_, camera_.world_from_camera.rotation, world_.dt_s,
                        {options_.linear_sigma, options_.angular_sigma});
    p_.topRows<kCamera>() = (j.f * p_.topRows<kCamera>()).eval();
    p_.leftCols<kCamera>() = (p_.leftCols<kCamera>() * j.f.transpose()).eval();
    p_.topLeftCorner<kCamera, kCamera>() += j.q;
    camera_ = PropagateMotion(camera_, world_.dt_s);
  }
  const std::vector<Row> rows = Match(frame);
  if (!rows.empty()) {
    if (const absl::Status status = Update(rows); !status.ok()) return status;
  }
  Birth(frame, rows.size());
  PointsStep step;
  step.matches = static_cast<int>(rows.size());
  const Vector12d error = Minus(TrueMotion(frame), camera_);
  const Eigen::LDLT<Matrix6d> covariance(p_.topLeftCorner<6, 6>());
  if (covariance.info() != Eigen::Success || !covariance.isPositive()) {
    return absl::FailedPreconditionError(
        absl::StrCat("xyz, frame ", index, ": the pose covariance is not positive definite"));
  }
  step.nees = error.head<6>().dot(covariance.solve(error.head<6>()));
  step.position_nees = error.head<3>().dot(p_.topLeftCorner<3, 3>().ldlt().solve(error.head<3>()));
  step.position_error_m = error.head<3>().norm();
  step.rotation_error_rad = error.segment<3>(3).norm();
  return step;
}

}  // namespace saccade
