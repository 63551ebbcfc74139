#include "server/mount/calibration/calibration_fit.hpp"

#include <algorithm>
#include <cmath>

#include "shared/geometry/angle.hpp"

namespace saccade {
namespace {

constexpr double kHuber = 2.0;           // sigmas
constexpr double kOffsetSigma_m = 0.03;  // of the offsets given: along an axis nothing else tells
constexpr double kDelaySigma_s = 0.2;
constexpr double kLeastRotationSigma_rad = 0.05 * kDegree;
constexpr double kLeastPositionSigma_m = 0.001;
constexpr int kSteps = 60;
constexpr Timestamp kPairSpan = 500'000'000;

// Places of the parameters: axes (two each), base's rotation and position, delay, offsets.
constexpr int kAxisAt = 0, kRotationAt = 6, kPositionAt = 9, kDelayAt = 12, kOffsetAt = 13;
constexpr int kParameters = 22;
constexpr double kNumericStep = 1e-6;

using Vector = Eigen::VectorXd;

/// Two unit vectors across `axis`.
Eigen::Matrix<double, 3, 2> Across(const Eigen::Vector3d& axis) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = axis.unitOrthogonal();
  basis.col(1) = axis.cross(basis.col(0));
  return basis;
}

MountChain Moved(const MountChain& chain, const Eigen::Matrix<double, kParameters, 1>& by) {
  MountChain next = chain;
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const Eigen::Vector3d turn = Across(chain.axes[k]) * by.segment<2>(kAxisAt + 2 * at);
    next.axes[k] = (ExpSo3(turn) * chain.axes[k]).normalized();
    next.offsets[k] += by.segment<3>(kOffsetAt + 3 * at);
  }
  next.world_from_mount.rotation =
      (chain.world_from_mount.rotation * ExpQuaternion(by.segment<3>(kRotationAt))).normalized();
  next.world_from_mount.translation += by.segment<3>(kPositionAt);
  next.delay_s += by(kDelayAt);
  return next;
}

class Problem {
 public:
  Problem(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
          const MountChain& start, double angle_sigma_rad, bool metric)
      : pictures_(pictures),
        track_(track),
        start_(start),
        angle_sigma_rad_(angle_sigma_rad),
        metric_(metric) {
    for (int k = 0; k < kParameters; ++k) {
      const bool position = k >= kOffsetAt || (k >= kPositionAt && k < kDelayAt);
      const bool still = k < kRotationAt && !start.moved[static_cast<std::size_t>(k / 2)];
      if (!(position && !metric) && !still) free_.push_back(k);
    }
  }

  const std::vector<int>& free() const { return free_; }

  /// Whitened; six rows a picture, then the priors.
  Vector Residuals(const MountChain& chain) const {
    const auto n = static_cast<Eigen::Index>(pictures_.size());
    Vector r = Vector::Zero(6 * n + 3 * kMountJoints + 1);
    for (Eigen::Index k = 0; k < n; ++k) {
      const CalibrationData::Picture& picture = pictures_[static_cast<std::size_t>(k)];
      const double tracker = std::max(picture.rotation_sigma_rad, kLeastRotationSigma_rad);
      r.segment<3>(6 * k) =
          RotationResidual(chain, track_, picture) / std::hypot(tracker, angle_sigma_rad_);
      if (!metric_) continue;
      const Rigid3 predicted = chain.WorldFromCamera(AnglesAt(chain, picture));
      r.segment<3>(6 * k + 3) = (picture.world_from_camera.translation - predicted.translation) /
                                std::max(picture.position_sigma_m, kLeastPositionSigma_m);
    }
    for (Eigen::Index k = 0; k < kMountJoints; ++k) {
      const auto joint = static_cast<std::size_t>(k);
      r.segment<3>(6 * n + 3 * k) = (chain.offsets[joint] - start_.offsets[joint]) / kOffsetSigma_m;
    }
    r(r.size() - 1) = chain.delay_s / kDelaySigma_s;
    return r;
  }

  /// Huber: weights by the length of each picture's rotation and position.
  Vector Weights(const Vector& r) const {
    Vector w = Vector::Ones(r.size());
    for (Eigen::Index k = 0; k + 3 <= static_cast<Eigen::Index>(6 * pictures_.size()); k += 3) {
      const double length = r.segment<3>(k).norm() / std::sqrt(3.0);
      if (length > kHuber) w.segment<3>(k).setConstant(kHuber / length);
    }
    return w;
  }

  Eigen::MatrixXd Jacobian(const MountChain& chain) const {
    Eigen::MatrixXd jacobian;
    for (std::size_t column = 0; column < free_.size(); ++column) {
      Eigen::Matrix<double, kParameters, 1> by = Eigen::Matrix<double, kParameters, 1>::Zero();
      // A reading's interpolation has corners every 10 ms: the delay is felt over more than that.
      const double step = free_[column] == kDelayAt ? 5e-3 : kNumericStep;
      by(free_[column]) = step;
      const Vector ahead = Residuals(Moved(chain, by));
      by(free_[column]) = -step;
      const Vector slope = (ahead - Residuals(Moved(chain, by))) / (2 * step);
      if (column == 0) jacobian.resize(slope.size(), static_cast<Eigen::Index>(free_.size()));
      jacobian.col(static_cast<Eigen::Index>(column)) = slope;
    }
    return jacobian;
  }

  Eigen::Matrix<double, kParameters, 1> Spread(const Vector& free) const {
    Eigen::Matrix<double, kParameters, 1> all = Eigen::Matrix<double, kParameters, 1>::Zero();
    for (std::size_t k = 0; k < free_.size(); ++k)
      all(free_[k]) = free(static_cast<Eigen::Index>(k));
    return all;
  }

 private:
  Eigen::Vector3d AnglesAt(const MountChain& chain, const CalibrationData::Picture& picture) const {
    return track_.At(picture.time_ns + static_cast<Timestamp>(std::llround(1e9 * chain.delay_s)));
  }

  const std::vector<CalibrationData::Picture>& pictures_;
  const AngleTrack& track_;
  const MountChain start_;
  const double angle_sigma_rad_;
  const bool metric_;
  std::vector<int> free_;
};

/// Cost that the Huber weights minimise.
double Cost(const Vector& r, const Vector& w) {
  double cost = 0;
  for (Eigen::Index k = 0; k < r.size(); ++k) cost += w(k) * (2.0 - w(k)) * r(k) * r(k);
  return cost;
}

}  // namespace

Rigid3 MountChain::WorldFromCamera(const Eigen::Vector3d& angles) const {
  Rigid3 pose = world_from_mount;
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(angles(static_cast<Eigen::Index>(k)), axes[k]));
    pose = pose * Rigid3{turn, turn * offsets[k]};
  }
  return pose;
}

AngleTrack::AngleTrack(const std::vector<EncoderReading>& readings,
                       const std::array<MountJoint, kMountJoints>& order) {
  for (const EncoderReading& reading : readings) {
    const Eigen::Vector3d by_joint = ToVector(reading.angles);
    if (!by_joint.allFinite()) continue;
    if (!times_.empty() && reading.time_ns <= times_.back()) continue;
    times_.push_back(reading.time_ns);
    angles_.push_back({by_joint(static_cast<int>(order[0])), by_joint(static_cast<int>(order[1])),
                       by_joint(static_cast<int>(order[2]))});
  }
  Smooth();
}

/// A parabola through each reading and its neighbours. Interpolating noisy readings makes least
/// squares prefer delays that fall between two of them, where the noise is less: 1 to 5 ms off.
void AngleTrack::Smooth() {
  constexpr std::size_t kEachWay = 4;
  const std::vector<Eigen::Vector3d> read = angles_;
  for (std::size_t k = 0; k < read.size(); ++k) {
    const std::size_t each = std::min({kEachWay, k, read.size() - 1 - k});
    if (each < 2) continue;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero(), right = Eigen::Matrix3d::Zero();
    for (std::size_t i = k - each; i <= k + each; ++i) {
      const double t = 1e2 * Seconds(times_[i] - times_[k]);
      const Eigen::Vector3d powers(1, t, t * t);
      normal += powers * powers.transpose();
      right += powers * read[i].transpose();
    }
    angles_[k] = normal.ldlt().solve(right).row(0);
  }
}

Eigen::Vector3d AngleTrack::At(Timestamp time_ns) const {
  const auto after = std::lower_bound(times_.begin(), times_.end(), time_ns);
  if (after == times_.begin()) return angles_.front();
  if (after == times_.end()) return angles_.back();
  const auto next = static_cast<std::size_t>(after - times_.begin());
  const double share = static_cast<double>(time_ns - times_[next - 1]) /
                       static_cast<double>(times_[next] - times_[next - 1]);
  return (1 - share) * angles_[next - 1] + share * angles_[next];
}

Eigen::Vector3d AngleTrack::Range() const {
  Eigen::Vector3d least = angles_.front(), most = least;
  for (const Eigen::Vector3d& one : angles_) {
    least = least.cwiseMin(one);
    most = most.cwiseMax(one);
  }
  return most - least;
}

Eigen::Vector3d RotationResidual(const MountChain& chain, const AngleTrack& track,
                                 const CalibrationData::Picture& picture) {
  const auto delay = static_cast<Timestamp>(std::llround(1e9 * chain.delay_s));
  const Rigid3 predicted = chain.WorldFromCamera(track.At(picture.time_ns + delay));
  return LogQuaternion(predicted.rotation.conjugate() * picture.world_from_camera.rotation);
}

void GuessAxes(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
               MountChain& chain) {
  std::array<Eigen::Vector3d, kMountJoints> sums;
  sums.fill(Eigen::Vector3d::Zero());
  std::size_t before = 0;
  for (const CalibrationData::Picture& picture : pictures) {
    while (pictures[before].time_ns < picture.time_ns - kPairSpan) ++before;
    const Eigen::Vector3d from = track.At(pictures[before].time_ns);
    const Eigen::Vector3d by = track.At(picture.time_ns) - from;
    Eigen::Index joint = 0;
    const double most = by.cwiseAbs().maxCoeff(&joint);
    const double rest = by.cwiseAbs().sum() - most;
    const double beyond = from.tail(2 - joint).cwiseAbs().sum();
    if (most < 2 * kDegree || rest > 0.2 * most || beyond > 5 * kDegree) continue;
    sums[static_cast<std::size_t>(joint)] +=
        (by(joint) > 0 ? 1.0 : -1.0) *
        LogQuaternion(pictures[before].world_from_camera.rotation.conjugate() *
                      picture.world_from_camera.rotation);
  }
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    if (chain.moved[k] && sums[k].norm() > 10 * kDegree) chain.axes[k] = sums[k].normalized();
  }
}

ChainFit FitChain(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
                  const MountChain& chain, double angle_sigma_rad, bool metric) {
  const Problem problem(pictures, track, chain, angle_sigma_rad, metric);
  ChainFit fit{.chain = chain, .axis_sigma_rad = {}, .delay_sigma_s = 0};
  double damping = 1e-3;
  Vector r = problem.Residuals(fit.chain), w = problem.Weights(r);
  double cost = Cost(r, w);
  Eigen::MatrixXd normal;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::MatrixXd jacobian = problem.Jacobian(fit.chain);
    normal = jacobian.transpose() * w.asDiagonal() * jacobian;
    const Vector gradient = jacobian.transpose() * w.cwiseProduct(r);
    double gained = 0;
    while (damping < 1e9) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += 1e-12;
      const MountChain next = Moved(fit.chain, problem.Spread(-damped.ldlt().solve(gradient)));
      const Vector other = problem.Residuals(next), weights = problem.Weights(other);
      const double less = cost - Cost(other, weights);
      if (less > 0) {
        gained = less;
        fit.chain = next;
        r = other;
        w = weights;
        cost -= less;
        damping = std::max(1e-9, damping / 5);
        break;
      }
      damping *= 4;
    }
    if (gained < 1e-9 * (1 + cost)) break;
  }
  const Eigen::MatrixXd covariance =
      normal.ldlt().solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
  for (std::size_t k = 0; k < problem.free().size(); ++k) {
    const int parameter = problem.free()[k];
    const auto at = static_cast<Eigen::Index>(k);
    const double sigma = std::sqrt(std::max(0.0, covariance(at, at)));
    if (parameter < kRotationAt) {
      double& axis = fit.axis_sigma_rad[static_cast<std::size_t>(parameter / 2)];
      axis = std::max(axis, sigma);
    }
    if (parameter == kDelayAt) fit.delay_sigma_s = sigma;
  }
  return fit;
}

}  // namespace saccade
