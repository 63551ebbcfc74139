#include "server/pipeline/inbox.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>

namespace saccade::inbox_test {
namespace {

using ::testing::ElementsAre;

using IntInbox = Inbox<int, std::string>;

TEST(Inbox, KeepsTheNewestItemAndEveryCommand) {
  IntInbox inbox(4);
  EXPECT_FALSE(inbox.PutNewest(1));
  EXPECT_TRUE(inbox.PutNewest(2));
  EXPECT_TRUE(inbox.Submit("a").ok());
  EXPECT_TRUE(inbox.Submit("b").ok());
  const auto batch = inbox.Wait({});
  ASSERT_TRUE(batch);
  EXPECT_EQ(batch->item, 2);
  EXPECT_THAT(batch->commands, ElementsAre("a", "b"));
}

TEST(Inbox, ACommandAloneWakesTheConsumer) {
  IntInbox inbox(4);
  std::jthread producer([&] { EXPECT_TRUE(inbox.Submit("reset").ok()); });
  const auto batch = inbox.Wait({});
  ASSERT_TRUE(batch);
  EXPECT_FALSE(batch->item);
  EXPECT_THAT(batch->commands, ElementsAre("reset"));
}

TEST(Inbox, AFullMailboxRefusesAndKeepsWhatItHas) {
  IntInbox inbox(2);
  EXPECT_TRUE(inbox.Submit("a").ok());
  EXPECT_TRUE(inbox.Submit("b").ok());
  std::string third = "c";
  EXPECT_EQ(inbox.Submit(std::move(third)).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(third, "c");  // untouched: the caller can still answer it
  EXPECT_THAT(inbox.Wait({})->commands, ElementsAre("a", "b"));
  EXPECT_TRUE(inbox.Submit("d").ok());
}

TEST(Inbox, CloseHandsOutWhatWaitsAndRefusesTheRest) {
  IntInbox inbox(2);
  EXPECT_TRUE(inbox.Submit("a").ok());
  EXPECT_THAT(inbox.Close(), ElementsAre("a"));
  EXPECT_EQ(inbox.Submit("b").code(), absl::StatusCode::kUnavailable);
}

TEST(Inbox, StopEndsAWait) {
  IntInbox inbox(1);
  std::stop_source source;
  std::jthread stopper([&] { source.request_stop(); });
  EXPECT_FALSE(inbox.Wait(source.get_token()));
  EXPECT_TRUE(inbox.PutWait(1, {}));
  EXPECT_FALSE(inbox.PutWait(2, source.get_token()));  // full, and stopped
}

TEST(Inbox, PutWaitLosesNoItem) {
  IntInbox inbox(1);
  constexpr int kItems = 2000;
  std::jthread producer([&](std::stop_token stop) {
    for (int i = 0; i < kItems; ++i) inbox.PutWait(i, stop);
  });
  for (int i = 0; i < kItems; ++i) EXPECT_EQ(inbox.Wait({})->item, i);
}

}  // namespace
}  // namespace saccade::inbox_test
