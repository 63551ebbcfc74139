#include "server/tracker/group_consistency.hpp"

#include <gtest/gtest.h>

#include <random>

#include "server/filter/point_model.hpp"
#include "tests/support/pinhole.hpp"

namespace saccade::group_consistency_test {
namespace {

constexpr int kGroups = 4, kInGroup = 12;

/// Points at 1 to 4 m, seen from four clones that are each turned by up to a degree from where they
/// are thought to be, by a camera that is 3 cm and a degree from where it is thought to be.
class GroupConsistency : public ::testing::Test {
 protected:
  GroupConsistency() {
    const CameraModel lens(Pinhole(640, 480, 500));
    const Rigid3 thought, truth{ExpQuaternion({0.012, -0.009, 0.006}), {0.02, -0.015, 0.02}};
    for (int group = 0; group < kGroups; ++group) {
      const Rigid3 clone{ExpQuaternion({0.1 * Uniform(), 0.1 * Uniform(), 0}),
                         {0.4 * Uniform(), 0.3 * Uniform(), 0.2 * Uniform()}};
      const Rigid3 real{
          clone.rotation * ExpQuaternion({0.015 * Uniform(), 0.015 * Uniform(), 0.01 * Uniform()}),
          clone.translation};
      while (std::ssize(matches_) < (group + 1) * kInGroup) {
        const Eigen::Vector2d pixel(320 + 280 * Uniform(), 240 + 200 * Uniform());
        PointFromClone point;
        point.world_from_clone = clone;
        point.bearing = (clone.Inverse() * ((2.5 + 1.5 * Uniform()) * *lens.Unproject(pixel)));
        point.inverse_range = 1.0 / point.bearing.norm();
        point.bearing.normalize();
        point.basis = TangentBasis(point.bearing);
        PointFromClone seen = point;
        seen.world_from_clone = real;
        const auto at = PredictFromClone(lens, thought, point);
        const auto found = PredictFromClone(lens, truth, seen);
        if (!at || !found) continue;
        const Eigen::Vector2d noise(0.3 * Uniform(), 0.3 * Uniform());
        matches_.push_back(
            {group, found->pixel + noise - at->pixel, at->d_camera, at->d_clone.rightCols<3>()});
      }
    }
  }
  double Uniform() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }
  static Eigen::Matrix<double, 6, 1> Sigma() {
    Eigen::Matrix<double, 6, 1> sigma;
    sigma << 0.07, 0.07, 0.07, 0.07, 0.07, 0.07;
    return sigma;
  }

  std::mt19937_64 random_{3};
  std::vector<GroupResidual> matches_;
};

TEST_F(GroupConsistency, WhatSharesAnErrorAgrees) {
  double largest = 0;
  for (const GroupResidual& each : matches_) largest = std::max(largest, each.residual.norm());
  EXPECT_GT(largest, 12.0) << "far more than is called false";
  for (const bool agrees : AgreeTogether(matches_, Sigma())) EXPECT_TRUE(agrees);
}

TEST_F(GroupConsistency, WhatIsOffAloneIsFalse) {
  for (std::size_t k = 0; k < matches_.size(); k += 6) {
    matches_[k].residual += 8.0 * Eigen::Vector2d(Uniform() > 0 ? 1 : -1, Uniform()).normalized();
  }
  const std::vector<bool> agrees = AgreeTogether(matches_, Sigma());
  for (std::size_t k = 0; k < matches_.size(); ++k) EXPECT_EQ(agrees[k], k % 6 != 0) << k;
}

TEST_F(GroupConsistency, WhereHalfIsFalseNothingIsSaid) {
  for (GroupResidual& each : matches_)
    each.residual += 60.0 * Eigen::Vector2d(Uniform(), Uniform());
  for (const bool agrees : AgreeTogether(matches_, Sigma())) EXPECT_TRUE(agrees);
  EXPECT_TRUE(AgreeTogether({}, Sigma()).empty());
}

}  // namespace
}  // namespace saccade::group_consistency_test
