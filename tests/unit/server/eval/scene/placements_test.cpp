#include "server/eval/scene/placements.hpp"

#include <gtest/gtest.h>

#include "server/eval/scene/placement_judge.hpp"
#include "shared/models/shapes.hpp"

namespace saccade::placements_test {
namespace {

using Triangle = PlacementJudge::Triangle;

const Triangle kFlat = {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0),
                        Eigen::Vector3d(0, 1, 0)};
Triangle Moved(const Triangle& t, const Eigen::Vector3d& by) {
  return {t[0] + by, t[1] + by, t[2] + by};
}

TEST(PlacementJudge, KnowsDistancesOfTriangles) {
  EXPECT_NEAR(TriangleDistance(kFlat, Moved(kFlat, {0.1, 0.1, 0.3})), 0.3, 1e-12);  // face, corner
  EXPECT_NEAR(TriangleDistance(kFlat, Moved(kFlat, {-1, -1, 0})), std::sqrt(0.5), 1e-12);
  const Triangle crossing = {Eigen::Vector3d(0.2, 0.2, -1), Eigen::Vector3d(0.2, 0.2, 1),
                             Eigen::Vector3d(5, 5, 0)};
  EXPECT_EQ(TriangleDistance(kFlat, crossing), 0);
  // Edge over edge, crosswise.
  const Triangle over = {Eigen::Vector3d(0.5, -1, 0.25), Eigen::Vector3d(0.5, 1, 0.25),
                         Eigen::Vector3d(0.5, 0, 9)};
  EXPECT_NEAR(TriangleDistance(kFlat, over), 0.25, 1e-12);
}

TEST(PlacementJudge, SeesCutsAndWhatLiesInside) {
  const TriangleMesh box = BoxMesh({1, 1, 1}, 0), small = BoxMesh({0.1, 0.1, 0.1}, 0);
  const PlacementJudge judge({box}, {true});
  EXPECT_TRUE(judge.Cuts(small, {Eigen::Quaterniond::Identity(), {0.1, -0.5, 0.05}}));
  EXPECT_TRUE(judge.Cuts(small, {Eigen::Quaterniond::Identity(), {0.5, -0.5, 0.013}}));
  const Rigid3 above{Eigen::Quaterniond::Identity(), {0, -1.0005, 0}};
  EXPECT_FALSE(judge.Cuts(small, above));
  EXPECT_NEAR(judge.Distance(small, above, 0.01), 5e-4, 1e-7);
  EXPECT_NEAR(judge.Gap(small, above, Eigen::Vector3d::UnitY(), 2e-3), 5e-4, 3e-6);
  const Rigid3 sunk{Eigen::Quaterniond::Identity(), {0, -0.9995, 0}};
  EXPECT_NEAR(judge.Gap(small, sunk, Eigen::Vector3d::UnitY(), 2e-3), -5e-4, 3e-6);
}

TEST(Placements, RestWithinAMillimetreByAnIndependentJudge) {
  int placed = 0, slid = 0;
  for (std::uint64_t index = 0; placed < 25; ++index) {
    ASSERT_LT(index, 200u);
    const PlacementOutcome one = RunPlacement(7, index);
    if (!one.refused.empty()) {
      EXPECT_TRUE(one.refused_rightly) << index << ": " << one.refused;
      continue;
    }
    ++placed;
    slid += one.slid_m > 0.01 ? 1 : 0;
    EXPECT_LT(std::abs(one.rest_gap_m), 1e-3) << index << " " << one.thing;
    EXPECT_LT(std::abs(one.push_gap_m), 1e-3) << index << " " << one.thing;
    EXPECT_TRUE(one.path_free) << index << " " << one.thing;
  }
  EXPECT_GE(slid, 4);
}

}  // namespace
}  // namespace saccade::placements_test
