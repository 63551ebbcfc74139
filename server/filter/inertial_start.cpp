#include "server/filter/inertial_start.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace saccade {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

using E = InertialErrors;

/// Unknowns: [ln scale | gyro bias, accelerometer bias, gravity, offset | 9 of each pose].
constexpr int kScale = 0, kShared = 1, kSharedSize = E::kDim - E::kGyroBias;
constexpr int kPoses = kShared + kSharedSize, kEach = E::kGyroBias;
constexpr double kLargestLog = 10.0;  // of the scale: nobody walks 20 km in a second

class Problem {
 public:
  Problem(std::span<const SeenPose> poses, std::span<const ImuSample> samples, const ImuInfo& unit,
          const InertialStartOptions& options)
      : poses_(poses), samples_(samples), unit_(unit), options_(options) {
    ImuState imu;
    imu.camera_from_imu = unit.camera_from_imu;
    motions_.resize(poses.size());
    for (std::size_t k = 0; k < poses.size(); ++k) {
      motions_[k].world_from_camera = poses[k].world_from_camera;
      motions_[k].world_from_camera.translation -= poses.front().world_from_camera.translation;
      motions_[k].imu = imu;
    }
  }

  bool Solve(InertialSolution& solution) {
    for (int iteration = 0; iteration <= options_.iterations; ++iteration) {
      const bool first = iteration == 0;  // linear but for the length of gravity
      if (!Linearise(std::exp(log_scale_), /*with_gravity=*/!first)) return false;
      const Eigen::LDLT<MatrixXd> factor(a_);
      if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0.0)) return false;
      if (iteration == options_.iterations) {
        solution.misfit = cost_ / dof_;
        Read(factor, solution);
        return solution.covariance.allFinite();
      }
      const VectorXd step = factor.solve(b_);
      if (!step.allFinite()) return false;
      Move(step, first);
      if (!(std::abs(log_scale_) < kLargestLog)) return false;
    }
    return false;
  }

 private:
  int At(std::size_t pose) const { return kPoses + kEach * static_cast<int>(pose); }

  /// A residual r(x) whitened by `information`: adds J^T W J and -J^T W r. Columns of `jacobian`
  /// are those of `at`, in runs.
  struct Run {
    int at, size;
  };
  void Add(const VectorXd& residual, const MatrixXd& jacobian, std::span<const Run> runs,
           const MatrixXd& information) {
    const MatrixXd weighted = information * jacobian;
    const MatrixXd square = jacobian.transpose() * weighted;
    const VectorXd pull = weighted.transpose() * residual;
    int row = 0;
    for (const Run& r : runs) {
      int col = 0;
      for (const Run& c : runs) {
        a_.block(r.at, c.at, r.size, c.size) += square.block(row, col, r.size, c.size);
        col += c.size;
      }
      b_.segment(r.at, r.size) -= pull.segment(row, r.size);
      row += r.size;
    }
    cost_ += residual.dot(information * residual);
    dof_ += static_cast<double>(residual.size());
  }

  bool AddSteps() {
    for (std::size_t k = 0; k + 1 < poses_.size(); ++k) {
      const ImuStep step{samples_, poses_[k].time_ns, poses_[k + 1].time_ns, unit_.noise};
      if (!Covers(step, motions_[k].imu.offset_s)) return false;
      const MotionModel::Step by = PropagateInertial(motions_[k], step);
      const VectorXd residual = InertialMotion().Minus(motions_[k + 1], by.next).head<kEach>();
      MatrixXd jacobian(kEach, kEach + kSharedSize + kEach);
      jacobian.leftCols<kEach>() = -by.f.topLeftCorner<kEach, kEach>();
      jacobian.middleCols<kSharedSize>(kEach) = -by.f.topRightCorner<kEach, kSharedSize>();
      jacobian.rightCols<kEach>().setIdentity();
      // Log(next^-1 now) by either side's rotation.
      const Vector3d off = residual.segment<3>(E::kRotation);
      const Matrix3d right = RightJacobianSo3(off).inverse();
      jacobian.block(E::kRotation, 0, 3, kEach + kSharedSize) =
          (RightJacobianSo3(-off).inverse() *
           jacobian.block(E::kRotation, 0, 3, kEach + kSharedSize))
              .eval();
      jacobian.block<3, 3>(E::kRotation, kEach + kSharedSize + E::kRotation) = right;
      MatrixXd noise = by.q.topLeftCorner<kEach, kEach>();
      noise.diagonal().head<3>().array() += 1e-10;  // [m^2]: white noise alone leaves none
      const std::array runs = {Run{At(k), kEach}, Run{kShared, kSharedSize}, Run{At(k + 1), kEach}};
      Add(residual, jacobian, runs, noise.inverse());
      dof_ -= 3.0;  // a velocity each
    }
    return true;
  }

  void AddPoses(double scale) {
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      const SeenPose& seen = poses_[k];
      const Rigid3& now = motions_[k].world_from_camera;
      const Vector3d gone = scale * (seen.world_from_camera.translation -
                                     poses_.front().world_from_camera.translation);
      VectorXd residual(6);
      residual << now.translation - gone,
          LogQuaternion(seen.world_from_camera.rotation.conjugate() * now.rotation);
      MatrixXd jacobian = MatrixXd::Zero(6, 7);
      jacobian.block<3, 1>(0, 0) = -gone;
      jacobian.block<3, 3>(0, 1).setIdentity();
      jacobian.block<3, 3>(3, 4) = RightJacobianSo3(residual.tail<3>()).inverse();
      MatrixXd information = MatrixXd::Identity(6, 6);
      information.topLeftCorner<3, 3>() /= std::pow(scale * seen.position_sigma, 2);
      information.bottomRightCorner<3, 3>() /= std::pow(seen.rotation_sigma_rad, 2);
      const std::array runs = {Run{kScale, 1}, Run{At(k), 6}};
      Add(residual, jacobian, runs, information);
      dof_ -= 6.0;
    }
  }

  void AddPriors(bool with_gravity) {
    const ImuState& imu = motions_.front().imu;
    const auto prior = [&](const VectorXd& value, int at, double sigma) {
      const auto n = value.size();
      const std::array runs = {Run{at, static_cast<int>(n)}};
      Add(value, MatrixXd::Identity(n, n), runs, MatrixXd::Identity(n, n) / (sigma * sigma));
    };
    const auto shared = [](int offset) { return kShared + offset - E::kGyroBias; };
    prior(imu.gyro_bias_rad_s, shared(E::kGyroBias), options_.gyro_bias_sigma_rad_s);
    prior(imu.accelerometer_bias_m_s2, shared(E::kAccelerometerBias),
          options_.accelerometer_bias_sigma_m_s2);
    prior(VectorXd::Constant(1, imu.offset_s), shared(E::kOffset), unit_.offset_sigma_s);
    dof_ -= 8.0;  // against all that is shared, and the scale
    if (!with_gravity) return;
    const double length = imu.gravity_m_s2.norm();
    const std::array runs = {Run{shared(E::kGravity), 3}};
    Add(VectorXd::Constant(1, length - options_.gravity_m_s2),
        imu.gravity_m_s2.transpose() / length, runs,
        MatrixXd::Constant(1, 1, std::pow(options_.gravity_sigma_m_s2, -2)));
  }

  bool Linearise(double scale, bool with_gravity) {
    const int size = At(poses_.size());
    a_ = MatrixXd::Zero(size, size);
    b_ = VectorXd::Zero(size);
    cost_ = dof_ = 0.0;
    if (!AddSteps()) return false;
    AddPoses(scale);
    AddPriors(with_gravity);
    return true;
  }

  void Move(const VectorXd& step, bool first) {
    // Linear in the scale, of which the unknown is the logarithm.
    const double factor = 1.0 + std::clamp(step[kScale], first ? -0.9 : -0.5, first ? 1e3 : 1.0);
    log_scale_ += std::log(factor);
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      MotionModel::Errors error = MotionModel::Errors::Zero(E::kDim);
      error.head<kEach>() = step.segment<kEach>(At(k));
      error.tail<kSharedSize>() = step.segment<kSharedSize>(kShared);
      motions_[k] = InertialMotion().Plus(motions_[k], error);
    }
  }

  void Read(const Eigen::LDLT<MatrixXd>& factor, InertialSolution& solution) const {
    const std::size_t last = poses_.size() - 1;
    const int size = static_cast<int>(a_.rows());
    std::vector<int> rows = {kScale};  // of the unknowns, in the solution's order
    for (int k = 0; k < kEach; ++k) rows.push_back(At(last) + k);
    for (int k = 0; k < kSharedSize; ++k) rows.push_back(kShared + k);
    MatrixXd picked = MatrixXd::Zero(size, std::ssize(rows));
    for (std::size_t k = 0; k < rows.size(); ++k) picked(rows[k], static_cast<Eigen::Index>(k)) = 1;
    const MatrixXd columns = factor.solve(picked);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      solution.covariance.row(static_cast<Eigen::Index>(k)) = columns.row(rows[k]);
    }
    solution.covariance.middleRows<6>(1).setZero();
    solution.covariance.middleCols<6>(1).setZero();
    solution.metres_per_unit = std::exp(log_scale_);
    solution.scale_sigma = std::sqrt(std::max(0.0, solution.covariance(0, 0)));
    solution.motion = motions_[last];
    solution.motion.world_from_camera = poses_[last].world_from_camera;
    solution.motion.world_from_camera.translation *= solution.metres_per_unit;
  }

  std::span<const SeenPose> poses_;
  std::span<const ImuSample> samples_;
  const ImuInfo& unit_;
  const InertialStartOptions& options_;
  std::vector<CameraMotion> motions_;  // in metres
  double log_scale_ = 0.0;
  MatrixXd a_;
  VectorXd b_;
  double cost_ = 0.0, dof_ = 0.0;
};

}  // namespace

void TurnWorld(const Eigen::Quaterniond& turn, InertialSolution& solution) {
  solution.motion.world_from_camera =
      Rigid3{turn, Vector3d::Zero()} * solution.motion.world_from_camera;
  solution.motion.velocity_m_s = turn * solution.motion.velocity_m_s;
  solution.motion.imu.gravity_m_s2 = turn * solution.motion.imu.gravity_m_s2;
  const Matrix3d matrix = turn.toRotationMatrix();
  for (const int offset : {E::kVelocity, E::kGravity}) {
    solution.covariance.middleRows<3>(1 + offset) =
        (matrix * solution.covariance.middleRows<3>(1 + offset)).eval();
    solution.covariance.middleCols<3>(1 + offset) =
        (solution.covariance.middleCols<3>(1 + offset) * matrix.transpose()).eval();
  }
}

std::optional<InertialSolution> SolveInertialStart(std::span<const SeenPose> poses,
                                                   std::span<const ImuSample> samples,
                                                   const ImuInfo& unit,
                                                   const InertialStartOptions& options) {
  constexpr std::size_t kFewest = 4;
  if (poses.size() < kFewest || samples.empty()) return std::nullopt;
  InertialSolution solution;
  if (!Problem(poses, samples, unit, options).Solve(solution)) return std::nullopt;
  return solution;
}

}  // namespace saccade
