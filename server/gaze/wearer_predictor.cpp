#include "server/gaze/wearer_predictor.hpp"

#include <algorithm>

namespace saccade {
namespace {

constexpr double kMaxHorizon_s = 0.3;        // further than this nobody knows
constexpr double kAccelerates_s = 0.12;      // then goes on at the rate it has
constexpr std::size_t kFewestPredicted = 8;  // poses, if there are so many...
constexpr double kLongest = 3.0;             // ...in so many windows

}  // namespace

void WearerPredictor::Add(Timestamp time_ns, const Rigid3& world_from_mount) {
  if (!poses_.empty() && time_ns <= poses_.back().time_ns) {
    if (Seconds(poses_.back().time_ns - time_ns) <= kLongest * window_s_) return;
    poses_.clear();  // the clock was set back
  }
  poses_.push_back({time_ns, world_from_mount});
  // After a gap (a fast saccade) what was before it says more of the rate than two poses since.
  while (Seconds(time_ns - poses_.front().time_ns) > window_s_ &&
         (poses_.size() > kFewestPredicted ||
          Seconds(time_ns - poses_.front().time_ns) > kLongest * window_s_)) {
    poses_.pop_front();
  }
  Fit();
}

// A parabola through position and rotation over time, a line where poses are few.
void WearerPredictor::Fit() {
  motion_.setZero();
  const Eigen::Index terms = poses_.size() >= 5 ? 3 : poses_.size() >= 3 ? 2 : 1;
  const Pose& newest = poses_.back();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 6> right = Eigen::Matrix<double, 3, 6>::Zero();
  for (const Pose& pose : poses_) {
    const double t = Seconds(pose.time_ns - newest.time_ns) / window_s_;
    const Eigen::Vector3d powers(1, t, t * t);
    Eigen::Matrix<double, 1, 6> moved;
    moved << (pose.world_from_mount.translation - newest.world_from_mount.translation).transpose(),
        LogQuaternion(newest.world_from_mount.rotation.conjugate() * pose.world_from_mount.rotation)
            .transpose();
    normal += powers * powers.transpose();
    right += powers * moved;
  }
  if (terms == 1) return;
  const Eigen::MatrixXd fitted =
      normal.topLeftCorner(terms, terms).ldlt().solve(right.topRows(terms));
  motion_.leftCols(terms) = fitted.transpose();
  motion_.col(1) /= window_s_;
  motion_.col(2) /= window_s_ * window_s_;
}

std::optional<Timestamp> WearerPredictor::newest_ns() const {
  if (poses_.empty()) return std::nullopt;
  return poses_.back().time_ns;
}

std::optional<Rigid3> WearerPredictor::Newest() const {
  if (poses_.empty()) return std::nullopt;
  return poses_.back().world_from_mount;
}

std::optional<Rigid3> WearerPredictor::At(Timestamp time_ns) const {
  if (poses_.empty()) return std::nullopt;
  const Pose& newest = poses_.back();
  const double ahead_s =
      std::clamp(Seconds(time_ns - newest.time_ns), -kMaxHorizon_s, kMaxHorizon_s);
  // Nobody accelerates for long.
  const double bent_s = std::min(ahead_s, kAccelerates_s);
  const Eigen::Matrix<double, 6, 1> moved =
      motion_.col(0) + ahead_s * motion_.col(1) + bent_s * (2 * ahead_s - bent_s) * motion_.col(2);
  Rigid3 pose = newest.world_from_mount;
  pose.translation += moved.head<3>();
  pose.rotation = (pose.rotation * ExpQuaternion(moved.tail<3>())).normalized();
  return pose;
}

}  // namespace saccade
