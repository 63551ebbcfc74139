#include "server/gaze/explorer.hpp"

#include <gtest/gtest.h>

namespace saccade::explorer_test {
namespace {

FeatureSnapshot At(const Eigen::Vector3d& point, double sigma) {
  FeatureSnapshot feature;
  feature.point_in_world = point;
  feature.covariance_in_world = sigma * sigma * Eigen::Matrix3d::Identity();
  return feature;
}

TEST(Explorer, VisitsEveryUncertainPlaceInTurnAndNothingOutOfReach) {
  MapSnapshot map;
  const Eigen::Vector3d places[] = {{-1, 0, 1}, {1, 0, 1}, {0, 0, 2}, {0, -3, 0.01}};
  for (const Eigen::Vector3d& place : places) {
    for (int k = 0; k < 4; ++k) {
      map.features.push_back(At(place + Eigen::Vector3d(0.02 * k, 0, 0),
                                place.y() < 0 ? 1.0 : 0.125 + 0.075 * place.x()));
    }
  }
  Explorer explorer;
  int left = 0, right = 0, ahead = 0;
  for (int k = 0; k < 3; ++k) {
    const auto point = explorer.Choose(map, {}, MountModel());
    ASSERT_TRUE(point);
    left += point->x() < -0.5;
    right += point->x() > 0.5;
    ahead += std::abs(point->x()) < 0.5;
    EXPECT_GT(point->y(), -1) << "straight up is beyond the elevation's limit";
  }
  EXPECT_EQ(right, 1);
  EXPECT_EQ(ahead, 1);
  EXPECT_EQ(left, 1);
}

TEST(Explorer, AnEmptyMapGivesNothing) {
  EXPECT_FALSE(Explorer().Choose(MapSnapshot(), {}, MountModel()));
}

}  // namespace
}  // namespace saccade::explorer_test
