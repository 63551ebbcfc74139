#include "server/filter/state_layout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace saccade::state_layout_test {
namespace {

using ::testing::ElementsAre;

TEST(StateLayout, BlocksStandBehindOneAnotherAndCloseUp) {
  StateLayout layout;
  const int island = layout.AddIsland();
  const BlockId robot = layout.Add(BlockKind::kRobot, 3, island);
  const BlockId clone = layout.Add(BlockKind::kClone, 2, island);
  const BlockId feature = layout.Add(BlockKind::kFeature, 1, island);
  EXPECT_EQ(layout[feature].offset, 5);
  EXPECT_THAT(layout.Remove(island, std::vector<BlockId>{clone}), ElementsAre(0, 1, 2, 5));
  EXPECT_EQ(layout.dim(), 4);
  EXPECT_EQ(layout[robot].offset, 0);
  EXPECT_EQ(layout[feature].offset, 3);
  const BlockId next = layout.Add(BlockKind::kClone, 2, island);
  EXPECT_EQ(next, clone) << "ids are used again";
  EXPECT_THAT(layout.Blocks(island), ElementsAre(robot, feature, next));
  EXPECT_EQ(layout[next].offset, 4);
}

TEST(StateLayout, IslandsHaveRowsOfTheirOwnUntilTheyAreJoined) {
  StateLayout layout;
  const int one = layout.AddIsland();
  const BlockId a = layout.Add(BlockKind::kRobot, 12, one);
  const int two = layout.AddIsland();
  const BlockId b = layout.Add(BlockKind::kCamera, 6, two);
  const BlockId c = layout.Add(BlockKind::kFeature, 3, two);
  EXPECT_EQ(layout[b].offset, 0);
  EXPECT_EQ(layout.dim(), 21);
  EXPECT_THAT(layout.Remove(one, std::vector<BlockId>{c}), ::testing::SizeIs(12))
      << "blocks of others are left alone";
  layout.Join(one, two);
  EXPECT_EQ(layout.dim(one), 21);
  EXPECT_EQ(layout.dim(two), 0);
  EXPECT_EQ(layout[a].offset, 0);
  EXPECT_EQ(layout[b].offset, 12);
  EXPECT_EQ(layout[c].offset, 18);
  EXPECT_THAT(layout.Blocks(one), ElementsAre(a, b, c));
  EXPECT_EQ(layout.AddIsland(), two) << "an empty island serves again";
}

}  // namespace
}  // namespace saccade::state_layout_test
