#include "server/rpc/session_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

TEST(SessionTable, IdsAreDistinctUuids) {
  SessionTable sessions;
  std::set<std::string> ids;
  for (int i = 0; i < 200; ++i) {
    const auto session = sessions.Join({});
    ASSERT_TRUE(session.ok());
    EXPECT_TRUE(wire::CheckUuid(session->id, "id").ok()) << session->id;
    EXPECT_EQ(session->id[14], '4');
    ids.insert(session->id);
  }
  EXPECT_EQ(ids.size(), 200u);
}

TEST(SessionTable, AViewerMayLookAndNotTouch) {
  SessionTable sessions;
  v1::JoinRequest request;
  request.set_role(v1::ROLE_VIEWER);
  const auto viewer = sessions.Join(request);
  ASSERT_TRUE(viewer.ok());
  EXPECT_TRUE(sessions.Find(viewer->id).ok());
  EXPECT_EQ(sessions.FindEditor(viewer->id).status().code(), absl::StatusCode::kPermissionDenied);
}

TEST(SessionTable, UnknownAndMalformedIdsDiffer) {
  SessionTable sessions;
  EXPECT_EQ(sessions.Find("6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11").status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_EQ(sessions.Find("x").status().code(), absl::StatusCode::kInvalidArgument);
  v1::JoinRequest request;
  request.set_display_name(std::string(61, 'a'));
  EXPECT_THAT(std::string(sessions.Join(request).status().message()),
              ::testing::StartsWith("display_name: "));
  request.set_display_name("a\tb");
  EXPECT_FALSE(sessions.Join(request).ok());
}

TEST(SessionTable, IsBoundedAndForgetsTheUnusedFirst) {
  SessionTable sessions(3);
  const std::string first = sessions.Join({})->id;
  const std::string second = sessions.Join({})->id;
  ASSERT_TRUE(sessions.Join({}).ok());
  EXPECT_TRUE(sessions.Find(first).ok());
  ASSERT_TRUE(sessions.Join({}).ok());
  EXPECT_TRUE(sessions.Find(first).ok());
  EXPECT_FALSE(sessions.Find(second).ok());
}

TEST(SessionTable, TellsWhoIsGoneAndTellsItAgainUntilItIsTaken) {
  std::vector<std::string> told;
  bool takes = false;
  SessionTable sessions(2, [&](const std::string& id) {
    told.push_back(id);
    return takes;
  });
  const std::string first = sessions.Join({})->id;
  const std::string second = sessions.Join({})->id;
  EXPECT_TRUE(told.empty());
  ASSERT_TRUE(sessions.Join({}).ok());
  EXPECT_THAT(told, ::testing::ElementsAre(first));
  takes = true;
  ASSERT_TRUE(sessions.Join({}).ok());
  EXPECT_THAT(told, ::testing::ElementsAre(first, first, second));
  const std::size_t so_far = told.size();
  ASSERT_TRUE(sessions.Join({}).ok());
  EXPECT_EQ(told.size(), so_far + 1) << "what was taken is not told again";
}

}  // namespace
}  // namespace saccade
