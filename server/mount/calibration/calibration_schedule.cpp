#include "server/mount/calibration/calibration_schedule.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "shared/geometry/angle.hpp"

namespace saccade {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kEase_s = 1.0;             // at both ends of a part
constexpr double kLeast_rad = 2 * kDegree;  // a joint that may move less is left alone
constexpr double kOfLimits = 0.9;
constexpr double kRateSpan_s = 1e-3;
// Of the periods of the joints when all move: never the same place twice.
const Eigen::Vector3d kDetune{1.0, 1.17, 0.87};

double Smooth(double share) {
  const double x = std::clamp(share, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

}  // namespace

CalibrationSchedule::CalibrationSchedule(const MountOptions& mount, const MountAngles& start,
                                         const CalibrationMotion& motion)
    : rate_rad_s_(motion.rate_deg_s * kDegree), start_rad_(ToVector(start)) {
  Eigen::Vector3d reach = motion.reach_deg * kDegree;
  for (int k = 0; k < kMountJoints; ++k) {
    const JointOptions& joint = mount.joints[static_cast<std::size_t>(k)];
    reach(k) = std::min(reach(k), kOfLimits * std::min(-joint.min_rad, joint.max_rad));
    if (reach(k) < kLeast_rad) reach(k) = 0;
  }
  // The smooth step's steepest slope is 1.5.
  approach_s_ = 1.5 * start_rad_.cwiseAbs().maxCoeff() / rate_rad_s_;
  duration_s_ = approach_s_ + 0.5;
  for (int k = 0; k < kMountJoints; ++k) {
    if (reach(k) == 0) continue;
    Add(reach(k) * Eigen::Vector3d::Unit(k), kTwoPi * reach(k) / rate_rad_s_);
  }
  if (reach.maxCoeff() > 0) Add(reach, motion.combined_s);
}

void CalibrationSchedule::Add(const Eigen::Vector3d& reach_rad, double length_s) {
  const bool together = (reach_rad.array() > 0).count() > 1;
  Part part{duration_s_, duration_s_ + length_s, reach_rad, kTwoPi * reach_rad / rate_rad_s_};
  if (together) part.period_s = part.period_s.cwiseProduct(kDetune);
  parts_.push_back(part);
  duration_s_ = part.end_s + 0.3;
}

Eigen::Vector3d CalibrationSchedule::AnglesAt(double time_s) const {
  if (time_s < approach_s_) return start_rad_ * (1 - Smooth(time_s / approach_s_));
  Eigen::Vector3d angles = Eigen::Vector3d::Zero();
  for (const Part& part : parts_) {
    if (time_s <= part.begin_s || time_s >= part.end_s) continue;
    const double since = time_s - part.begin_s;
    const double ease = Smooth(since / kEase_s) * Smooth((part.end_s - time_s) / kEase_s);
    for (int k = 0; k < kMountJoints; ++k) {
      if (part.reach_rad(k) == 0) continue;
      angles(k) = ease * part.reach_rad(k) * std::sin(kTwoPi * since / part.period_s(k));
    }
  }
  return angles;
}

MountDemand CalibrationSchedule::At(double time_s) const {
  const double at = std::clamp(time_s, 0.0, duration_s_);
  MountDemand demand;
  demand.angles_rad = AnglesAt(at);
  if (at > 0 && at < duration_s_) {
    demand.rates_rad_s =
        (AnglesAt(at + kRateSpan_s) - AnglesAt(at - kRateSpan_s)) / (2 * kRateSpan_s);
  }
  demand.rate_limits_rad_s.setConstant(3 * rate_rad_s_);
  return demand;
}

}  // namespace saccade
