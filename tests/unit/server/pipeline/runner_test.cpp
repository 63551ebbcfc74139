#include "server/pipeline/runner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace saccade::runner_test {
namespace {

using ::testing::ElementsAre;

TEST(Runner, InlineStepsRunOnTheCallersThread) {
  std::vector<int> seen;
  Runner<int> runner({.inline_step = true}, [&](int value) { seen.push_back(value); });
  EXPECT_TRUE(runner.Post(1).ok());
  EXPECT_TRUE(runner.Post(2).ok());
  EXPECT_THAT(seen, ElementsAre(1, 2));
}

// Holds the first step until `open` is set, so that the queue behind it fills.
struct Gate {
  std::promise<void> entered, open;
  std::vector<int> seen;
  void Step(int value) {
    if (seen.empty()) {
      entered.set_value();
      open.get_future().wait();
    }
    seen.push_back(value);
  }
};

TEST(Runner, ABusyStageDropsTheOldest) {
  Gate gate;
  std::promise<void> last;
  Runner<int> runner({.capacity = 1, .when_full = WhenFull::kDropOldest}, [&](int value) {
    gate.Step(value);
    if (value == 4) last.set_value();
  });
  EXPECT_TRUE(runner.Post(1).ok());
  gate.entered.get_future().wait();
  for (int i = 2; i <= 4; ++i) EXPECT_TRUE(runner.Post(i).ok());
  gate.open.set_value();
  last.get_future().wait();
  runner.Stop();
  EXPECT_THAT(gate.seen, ElementsAre(1, 4));
  EXPECT_EQ(runner.dropped(), 2u);
}

TEST(Runner, ABusyStageRefusesWhenAskedTo) {
  Gate gate;
  Runner<int> runner({.capacity = 1, .when_full = WhenFull::kRefuse},
                     [&](int value) { gate.Step(value); });
  EXPECT_TRUE(runner.Post(1).ok());
  gate.entered.get_future().wait();
  EXPECT_TRUE(runner.Post(2).ok());
  EXPECT_EQ(runner.Post(3).code(), absl::StatusCode::kResourceExhausted);
  gate.open.set_value();
  runner.Stop();
  EXPECT_EQ(runner.Post(4).code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace saccade::runner_test
