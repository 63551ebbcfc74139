#include "server/rpc/session_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "server/pipeline/busy.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade::session_table_test {
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

TEST(SessionTable, APassHasItsShareOfSessionsAndThoseThatNobodyUsesMakeRoom) {
  SessionTable sessions({.max_sessions_of_token = 3});
  const Access ours{"p1", AccessRole::kPilot, 0}, theirs{"p2", AccessRole::kPilot, 0};
  std::vector<std::string> ids;
  for (int i = 0; i < 3; ++i) ids.push_back(sessions.Join({}, 0, ours)->id);
  const auto fourth = sessions.Join({}, 1, ours);
  EXPECT_EQ(fourth.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_GT(RetryAfterOf(fourth.status()), 0);
  EXPECT_TRUE(sessions.Join({}, 1, theirs).ok()) << "another pass has its own";
  v1::JoinRequest resume;
  resume.set_resume_session_id(ids[1]);
  EXPECT_TRUE(sessions.Join(resume, 1, ours).ok()) << "is one of the three";
  const auto held = sessions.Hold(ids[0]);
  EXPECT_TRUE(sessions.Join({}, 6'000'000'000, ours).ok());
  EXPECT_TRUE(sessions.Find(ids[0]).ok()) << "has a stream";
  EXPECT_FALSE(sessions.Find(ids[2]).ok()) << "was unused for longest";
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

constexpr Timestamp kSecond = 1'000'000'000;
constexpr Timestamp kMinute = 60 * kSecond;

// A thousand joins used to put out an expert at work.
TEST(SessionTable, WhoWorksIsNeverPutOutByWhoJoins) {
  SessionTable sessions({.max_sessions = 3});
  const std::string working = sessions.Join({}, 0)->id;
  const std::string watching = sessions.Join({}, 0)->id;
  const std::shared_ptr<void> stream = sessions.Hold(watching);
  ASSERT_TRUE(sessions.Find(working, kSecond).ok());
  for (int i = 0; i < 1000; ++i) {
    const Timestamp now_ns = 2 * kSecond + i * kSecond / 10;
    const absl::Status joined = sessions.Join({}, now_ns).status();
    if (joined.ok()) continue;
    EXPECT_EQ(joined.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_TRUE(RetryInfoOf(joined).has_value());
  }
  EXPECT_TRUE(sessions.Find(working, 103 * kSecond).ok());
  EXPECT_TRUE(sessions.Find(watching, 103 * kSecond).ok());
}

TEST(SessionTable, TheUnusedGoFirstThenThoseLongSilent) {
  SessionTable sessions({.max_sessions = 3});
  const std::string old = sessions.Join({}, 0)->id;
  ASSERT_TRUE(sessions.Find(old, kSecond).ok());
  const std::string unused = sessions.Join({}, 11 * kMinute)->id;
  ASSERT_TRUE(sessions.Join({}, 12 * kMinute).ok());
  ASSERT_TRUE(sessions.Join({}, 12 * kMinute).ok()) << "instead of the unused one";
  EXPECT_TRUE(sessions.Find(old, 1).ok());
  EXPECT_FALSE(sessions.Find(unused, 12 * kMinute).ok());
  ASSERT_TRUE(sessions.Join({}, 12 * kMinute + 1).ok()) << "instead of the silent one";
  EXPECT_FALSE(sessions.Find(old, 12 * kMinute).ok());
  EXPECT_FALSE(sessions.Join({}, 12 * kMinute + 2).ok()) << "the others have just come";
}

TEST(SessionTable, AStreamThatEndedKeepsItsSessionForAWhile) {
  SessionTable sessions({.max_sessions = 1, .unused_ns = 0, .idle_ns = 0});
  const std::string id = sessions.Join({})->id;
  std::shared_ptr<void> stream = sessions.Hold(id);
  EXPECT_FALSE(sessions.Join({}).ok());
  stream = nullptr;
  EXPECT_TRUE(sessions.Join({}).ok());
  EXPECT_EQ(sessions.Hold(id), nullptr);
}

TEST(SessionTable, TellsWhoIsGoneAndTellsItAgainUntilItIsTaken) {
  std::vector<std::string> told;
  bool takes = false;
  SessionTable sessions({.max_sessions = 2, .unused_ns = 0, .idle_ns = 0},
                        [&](const Session& gone) {
                          told.push_back(gone.participant_id);
                          return takes;
                        });
  const auto join_and_use = [&] {
    const absl::StatusOr<Session> session = sessions.Join({});
    EXPECT_TRUE(sessions.Find(session->id).ok());
    return session->participant_id;
  };
  const std::string first = join_and_use();
  const std::string second = join_and_use();
  EXPECT_TRUE(told.empty());
  join_and_use();
  EXPECT_THAT(told, ::testing::ElementsAre(first));
  takes = true;
  join_and_use();
  EXPECT_THAT(told, ::testing::ElementsAre(first, first, second));
  const std::size_t so_far = told.size();
  join_and_use();
  EXPECT_EQ(told.size(), so_far + 1) << "what was taken is not told again";
}

TEST(SessionTable, ASessionCanBeGoneOnWith) {
  SessionTable sessions;
  v1::JoinRequest request;
  request.set_display_name("Ann");
  const Session ann = *sessions.Join(request);
  EXPECT_NE(ann.id, ann.participant_id);
  request.set_resume_session_id(ann.id);
  request.set_display_name("Ann B");
  const Session again = *sessions.Join(request);
  EXPECT_EQ(again.id, ann.id);
  EXPECT_EQ(again.participant_id, ann.participant_id);
  EXPECT_EQ(sessions.Find(ann.id)->display_name, "Ann B");
  // Neither what others know nor what nobody knows leads there.
  request.set_resume_session_id(ann.participant_id);
  EXPECT_NE(sessions.Join(request)->id, ann.id);
  request.set_resume_session_id("not a UUID");
  EXPECT_FALSE(sessions.Join(request).ok());
}

TEST(SessionTable, NamesAreOneLineThatTurnsNothingAbout) {
  SessionTable sessions;
  v1::JoinRequest request;
  for (const char* name : {"Ann\n2026-11-29T00:00:00Z rpc Delete", "a\rb", "\x1b[2J",
                           "a\xe2\x80\xaez", "a\xe2\x80\xa8z", "a\xe2\x81\xa6z", "a\xc2\x85z",
                           "a\xc2\x9b"
                           "31m"}) {
    request.set_display_name(name);
    EXPECT_THAT(std::string(sessions.Join(request).status().message()),
                ::testing::StartsWith("display_name: "));
  }
  for (const char* name :
       {"J\xc3\xbcrgen", "\xd7\x93\xd7\xa0\xd7\x94", "\xf0\x9f\x94\xa7 Zo\xc3\xab"}) {
    request.set_display_name(name);
    EXPECT_TRUE(sessions.Join(request).ok()) << name;
  }
}

}  // namespace
}  // namespace saccade::session_table_test
