#include "server/mount/calibration/calibration_schedule.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "server/mount/fixed_joint.hpp"

namespace saccade::calibration_schedule_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

TEST(CalibrationSchedule, StaysWithinLimitsAndRateAndEndsAtRest) {
  MountOptions mount;
  mount.of(MountJoint::kElevation).max_rad = 10 * kDegree;
  FixJoint(mount.of(MountJoint::kCyclotorsion));
  const MountAngles start{40 * kDegree, -5 * kDegree, 0};
  const CalibrationSchedule schedule(mount, start);
  EXPECT_NEAR(schedule.At(0).angles_rad.x(), start.pan_rad, 1e-12);
  Eigen::Vector3d reach = Eigen::Vector3d::Zero(), last = schedule.At(0).angles_rad;
  double fastest = 0;
  for (double t = 0; t < schedule.duration_s(); t += 0.01) {
    const MountDemand demand = schedule.At(t);
    const Eigen::Vector3d by = demand.angles_rad - last;
    fastest = std::max(fastest, by.cwiseAbs().maxCoeff() / 0.01);
    EXPECT_LT((by - 0.01 * demand.rates_rad_s).cwiseAbs().maxCoeff(), 0.1 * kDegree);
    last = demand.angles_rad;
    if (t > 5) reach = reach.cwiseMax(demand.angles_rad.cwiseAbs());
  }
  EXPECT_LT(fastest, 25 * kDegree);
  EXPECT_NEAR(reach.x(), 30 * kDegree, 1 * kDegree);
  EXPECT_LE(reach.y(), 9 * kDegree);
  EXPECT_GT(reach.y(), 7 * kDegree);
  EXPECT_EQ(reach.z(), 0);
  EXPECT_EQ(schedule.At(schedule.duration_s()).angles_rad, Eigen::Vector3d::Zero());
  EXPECT_EQ(schedule.At(1e3).rates_rad_s, Eigen::Vector3d::Zero());
  EXPECT_LT(schedule.duration_s(), 60);
}

}  // namespace
}  // namespace saccade::calibration_schedule_test
