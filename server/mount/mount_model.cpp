#include "server/mount/mount_model.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kReached_rad = 1e-6;
constexpr int kRefinements = 12;
constexpr double kUnwinding = 0.1;  // way that a radian off the middle is worth

/// Of the turns of `angle` within the joint's limits the nearest to `near`, those further from the
/// middle handicapped: a head that always takes the shortest way winds itself up, and must unwind
/// when it can least afford it. Without one within the limits, the nearer limit.
double InLimits(double angle, double near, const JointOptions& joint) {
  std::optional<double> best;
  double shortest = 0;
  for (int turn = -3; turn <= 3; ++turn) {
    const double candidate = angle + turn * kTwoPi;
    if (candidate < joint.min_rad - 1e-12 || candidate > joint.max_rad + 1e-12) continue;
    const double way = std::abs(candidate - near) + kUnwinding * std::abs(candidate);
    if (best && way >= shortest) continue;
    best = candidate;
    shortest = way;
  }
  if (best) return *best;
  // The limit that is nearer round the circle.
  const double to_min = std::abs(std::remainder(angle - joint.min_rad, kTwoPi));
  const double to_max = std::abs(std::remainder(angle - joint.max_rad, kTwoPi));
  return to_min < to_max ? joint.min_rad : joint.max_rad;
}

}  // namespace

Rigid3 MountModel::MountFromCamera(const MountAngles& angles) const {
  const Eigen::Vector3d by_joint = ToVector(angles);
  Rigid3 pose;
  for (const MountJoint joint : options_.order) {
    const JointOptions& axis = options_.of(joint);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(by_joint(static_cast<int>(joint)), axis.axis));
    pose = pose * Rigid3{turn, turn * axis.offset_m};
  }
  return pose;
}

Eigen::Matrix<double, 6, 3> MountModel::Jacobian(const MountAngles& angles) const {
  const Rigid3 whole = MountFromCamera(angles);
  const Eigen::Vector3d by_joint = ToVector(angles);
  Eigen::Matrix<double, 6, 3> jacobian;
  Rigid3 base;
  for (const MountJoint joint : options_.order) {
    const JointOptions& axis = options_.of(joint);
    const int column = static_cast<int>(joint);
    const Eigen::Vector3d axis_in_mount = base.rotation * axis.axis;
    jacobian.col(column).head<3>() = axis_in_mount.cross(whole.translation - base.translation);
    jacobian.col(column).tail<3>() = whole.rotation.conjugate() * axis_in_mount;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(by_joint(column), axis.axis));
    base = base * Rigid3{turn, turn * axis.offset_m};
  }
  return jacobian;
}

MountAngles MountModel::Clamp(const MountAngles& angles) const {
  Eigen::Vector3d by_joint = ToVector(angles);
  for (int k = 0; k < kMountJoints; ++k) {
    const JointOptions& joint = options_.joints[static_cast<std::size_t>(k)];
    by_joint(k) = std::clamp(by_joint(k), joint.min_rad, joint.max_rad);
  }
  return ToAngles(by_joint);
}

bool MountModel::WithinLimits(const MountAngles& angles, double tolerance_rad) const {
  return (ToVector(Clamp(angles)) - ToVector(angles)).cwiseAbs().maxCoeff() <= tolerance_rad;
}

double MountModel::Miss(const MountAngles& angles, const Eigen::Vector3d& point_in_mount) const {
  const Eigen::Vector3d seen = MountFromCamera(angles).Inverse() * point_in_mount;
  return std::atan2(seen.head<2>().norm(), seen.z());
}

MountAngles MountModel::Level(const Eigen::Vector3d& down_in_mount,
                              const MountAngles& angles) const {
  const JointOptions& joint = options_.of(MountJoint::kCyclotorsion);
  MountAngles level = angles;
  // With torsion last, next to the camera, one step is exact; else this converges while its axis
  // lies near the optic one.
  for (int step = 0; step < 8; ++step) {
    const Eigen::Vector3d down =
        MountFromCamera(level).rotation.conjugate() * down_in_mount.normalized();
    if (down.head<2>().norm() < 1e-3) return level;
    const double roll = std::atan2(-down.x(), down.y());
    const double next = InLimits(level.cyclotorsion_rad + roll, level.cyclotorsion_rad, joint);
    const double moved = next - level.cyclotorsion_rad;
    level.cyclotorsion_rad = next;
    if (std::abs(moved) < 1e-12) break;
  }
  return level;
}

/// Closed form for the default axes without offsets; joints beyond their limits at the best place
/// that the others leave them.
MountAngles MountModel::Seed(const Eigen::Vector3d& direction, const MountAngles& near) const {
  const JointOptions& pan = options_.of(MountJoint::kPan);
  const JointOptions& elevation = options_.of(MountJoint::kElevation);
  const bool overhead = direction.head<1>().norm() + std::abs(direction.z()) < 1e-9;
  const double wanted = overhead ? near.pan_rad : std::atan2(direction.x(), direction.z());
  MountAngles best = near;
  double best_cosine = -2.0;
  for (const double a : {InLimits(wanted, near.pan_rad, pan), pan.min_rad, pan.max_rad}) {
    // In the panned frame the optic axis is (0, -sin e, cos e).
    const double forward = direction.x() * std::sin(a) + direction.z() * std::cos(a);
    const double free = std::atan2(-direction.y(), forward);
    for (const double e : {std::clamp(free, elevation.min_rad, elevation.max_rad),
                           elevation.min_rad, elevation.max_rad}) {
      const double cosine = -direction.y() * std::sin(e) + forward * std::cos(e);
      if (cosine <= best_cosine + 1e-12) continue;
      best_cosine = cosine;
      best.pan_rad = a;
      best.elevation_rad = e;
    }
  }
  return best;
}

/// Gauss-Newton on the bearing error by pan and elevation; a joint that its limit stops is left
/// out. For offsets and other axis orders; the closed form is a fixed point of it.
MountAngles MountModel::Refine(const Eigen::Vector3d& point, MountAngles angles) const {
  for (int step = 0; step < kRefinements; ++step) {
    const Rigid3 pose = MountFromCamera(angles);
    const Eigen::Vector3d seen = pose.Inverse() * point;
    const double depth = seen.norm();
    if (depth < 1e-6 || seen.z() < 0.05 * depth) return angles;  // not what Newton is for
    const Eigen::Matrix<double, 6, 3> jacobian = Jacobian(angles);
    // seen' = [seen]x dtheta - R^T dt
    const Eigen::Matrix<double, 3, 2> by_angles =
        (Skew(seen) * jacobian.bottomLeftCorner<3, 2>()) -
        pose.RotationMatrix().transpose() * jacobian.topLeftCorner<3, 2>();
    Eigen::Matrix<double, 2, 2> by_bearing =
        by_angles.topRows<2>() / seen.z() -
        seen.head<2>() * by_angles.row(2) / (seen.z() * seen.z());
    const Eigen::Vector2d error = seen.head<2>() / seen.z();
    Eigen::Vector2d now = ToVector(angles).head<2>(), next = now;
    for (int blocked = 0; blocked < 2; ++blocked) {
      // A little damping: a column may be zero.
      const Eigen::Matrix2d normal =
          by_bearing.transpose() * by_bearing + 1e-14 * Eigen::Matrix2d::Identity();
      const Eigen::Vector2d change = -(normal.inverse() * (by_bearing.transpose() * error));
      bool stopped = false;
      for (int k = 0; k < 2; ++k) {
        const JointOptions& joint = options_.joints[static_cast<std::size_t>(k)];
        next(k) = std::clamp(now(k) + change(k), joint.min_rad, joint.max_rad);
        if (next(k) != now(k) + change(k) && next(k) == now(k) && !by_bearing.col(k).isZero()) {
          by_bearing.col(k).setZero();
          stopped = true;
        }
      }
      if (!stopped) break;
    }
    angles.pan_rad = next(0);
    angles.elevation_rad = next(1);
    if ((next - now).cwiseAbs().maxCoeff() < 1e-12) break;
  }
  return angles;
}

FixationAngles MountModel::Fixate(const Eigen::Vector3d& point_in_mount,
                                  const std::optional<Eigen::Vector3d>& down_in_mount,
                                  const MountAngles& near) const {
  FixationAngles result;
  MountAngles angles = Clamp(near);
  // The optic centre moves with the joints, and torsion with both: three rounds settle to 1e-6.
  for (int round = 0; round < 3; ++round) {
    const Eigen::Vector3d line = point_in_mount - MountFromCamera(angles).translation;
    MountAngles seed = Seed(line.normalized(), round == 0 ? near : angles);
    seed.cyclotorsion_rad = angles.cyclotorsion_rad;
    angles = Refine(point_in_mount, seed);
    if (down_in_mount) angles = Level(*down_in_mount, angles);
  }
  result.angles = angles;
  result.miss_rad = Miss(angles, point_in_mount);
  result.reachable = result.miss_rad < std::max(kReached_rad, 1e-4);
  return result;
}

}  // namespace saccade
