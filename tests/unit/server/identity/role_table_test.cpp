#include "server/identity/role_table.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace saccade::role_table_test {
namespace {

TEST(RoleTable, EachCallHasOneRow) {
  std::set<std::string> seen;
  for (const RoleRow& row : RoleTable()) {
    EXPECT_TRUE(seen.insert(std::string(row.what)).second) << row.what << " is there twice";
  }
}

TEST(RoleTable, WhatItLacksIsOpenToNobody) {
  EXPECT_FALSE(LeastRole("SessionService/Nudge").has_value());
  EXPECT_EQ(LeastRole("SessionService/Join"), AccessRole::kViewer);
}

TEST(AccessRole, WordsGoBothWays) {
  for (const AccessRole role : {AccessRole::kViewer, AccessRole::kAnnotator, AccessRole::kPilot,
                                AccessRole::kWearer, AccessRole::kOwner}) {
    EXPECT_EQ(AccessRoleOf(Word(role)), role);
  }
  EXPECT_EQ(AccessRoleOf("admin"), AccessRole::kAnyone);
}

}  // namespace
}  // namespace saccade::role_table_test
