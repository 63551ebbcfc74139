#include "server/gaze/gaze_arbiter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace saccade::gaze_arbiter_test {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr Timestamp kMs = 1'000'000;
const GazeCaller kAnn{{"a", "Ann"}, false}, kBob{{"b", "Bob"}, false}, kCleo{{"c", "Cleo"}, false};
const GazeCaller kWearer{{"w", "Wilma"}, true};

class GazeArbiterTest : public ::testing::Test {
 protected:
  LeaseAnswer Acquire(const GazeCaller& caller, Timestamp now, const std::string& id = "") {
    const absl::StatusOr<LeaseAnswer> answer = arbiter_.Acquire(caller, id, now);
    EXPECT_TRUE(answer.ok()) << answer.status();
    return answer.value_or(LeaseAnswer());
  }
  std::string Pilot() const { return arbiter_.pilot() ? arbiter_.pilot()->display_name : ""; }

  int ids_ = 0;
  GazeArbiter arbiter_{GazeOptions(), [this] { return "lease" + std::to_string(++ids_); }};
};

TEST_F(GazeArbiterTest, OnePilotsTheOthersQueueInOrder) {
  EXPECT_TRUE(Acquire(kAnn, 0).granted);
  const LeaseAnswer bob = Acquire(kBob, 10 * kMs);
  EXPECT_FALSE(bob.granted);
  EXPECT_EQ(bob.queue_position, 1u);
  EXPECT_EQ(bob.pilot.display_name, "Ann");
  EXPECT_EQ(Acquire(kCleo, 20 * kMs).queue_position, 2u);
  EXPECT_EQ(Acquire(kBob, 30 * kMs).queue_position, 1u) << "asking again keeps the place";
  EXPECT_TRUE(arbiter_.MaySteer(kAnn, 40 * kMs).ok());
  const absl::Status fight = arbiter_.MaySteer(kBob, 50 * kMs);
  EXPECT_EQ(fight.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(std::string(fight.message()), HasSubstr("Ann pilots"));
  ASSERT_TRUE(arbiter_.Release(kAnn, 60 * kMs).ok());
  EXPECT_EQ(Pilot(), "Bob");
  EXPECT_EQ(arbiter_.last_words(), "Ann released; Bob pilots");
  EXPECT_THAT(arbiter_.queue(), SizeIs(1));
}

TEST_F(GazeArbiterTest, SilenceOfHalfASecondEndsTheLease) {
  const LeaseAnswer lease = Acquire(kAnn, 0);
  for (Timestamp t = 0; t <= 3000 * kMs; t += 400 * kMs) {
    EXPECT_TRUE(Acquire(kAnn, t, lease.lease_id).granted);
  }
  arbiter_.Tick(2800 * kMs + 499 * kMs);
  EXPECT_EQ(Pilot(), "Ann");
  arbiter_.Tick(2800 * kMs + 501 * kMs);
  EXPECT_EQ(Pilot(), "");
  const auto changes = arbiter_.TakeHandovers();
  ASSERT_THAT(changes, SizeIs(2));
  EXPECT_EQ(changes[1].why, Handover::Why::kVanished);
  EXPECT_EQ(changes[1].words, "Ann vanished; nobody pilots");
  EXPECT_EQ(arbiter_.Acquire(kAnn, lease.lease_id, 3400 * kMs).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST_F(GazeArbiterTest, TheNextInTheQueueHasTimeToNotice) {
  Acquire(kAnn, 0);
  Acquire(kBob, 100 * kMs);
  arbiter_.Tick(700 * kMs);
  EXPECT_EQ(Pilot(), "Bob");
  arbiter_.Tick(3000 * kMs);
  EXPECT_EQ(Pilot(), "Bob");
  arbiter_.Tick(3800 * kMs);
  EXPECT_EQ(Pilot(), "") << "he never noticed";
}

TEST_F(GazeArbiterTest, TheWearerTakesOverFromAnybodyAndGivesBack) {
  Acquire(kAnn, 0);
  ASSERT_TRUE(arbiter_.Override(kWearer, true, 100 * kMs).ok());
  EXPECT_EQ(Pilot(), "Wilma");
  EXPECT_EQ(arbiter_.last_words(), "the wearer took over from Ann");
  EXPECT_EQ(arbiter_.MaySteer(kAnn, 110 * kMs).code(), absl::StatusCode::kPermissionDenied);
  EXPECT_FALSE(Acquire(kAnn, 3000 * kMs).granted);
  arbiter_.Tick(6000 * kMs);
  EXPECT_EQ(Pilot(), "Wilma") << "the wearer needs no heartbeat";
  ASSERT_TRUE(arbiter_.Override(kWearer, false, 7000 * kMs).ok());
  EXPECT_EQ(Pilot(), "Ann") << "who lost it has it back";
  EXPECT_EQ(arbiter_.Override(kBob, true, 7100 * kMs).code(), absl::StatusCode::kPermissionDenied);
}

// A wearer who was gone used to hold the head for ever, and to have it back from the next.
TEST_F(GazeArbiterTest, AWearerWhoIsGoneLosesTheHead) {
  bool present = true;
  arbiter_.SetPresence([&](const std::string& id) { return present && id == "w"; });
  ASSERT_TRUE(arbiter_.Override(kWearer, true, 0).ok());
  arbiter_.Tick(3'600'000 * kMs);
  EXPECT_EQ(Pilot(), "Wilma") << "his page is open";
  present = false;
  arbiter_.Tick(3'609'000 * kMs);
  EXPECT_EQ(Pilot(), "Wilma") << "his page may be loading again";
  Acquire(kAnn, 3'609'000 * kMs);
  arbiter_.Tick(3'611'000 * kMs);
  EXPECT_EQ(Pilot(), "Ann");
  EXPECT_EQ(arbiter_.last_words(), "Wilma vanished; Ann pilots");
}

TEST_F(GazeArbiterTest, ANewWearerDoesNotGiveTheHeadBackToTheOldOne) {
  const GazeCaller ghost{{"g", "Ghost"}, true};
  ASSERT_TRUE(arbiter_.Override(ghost, true, 0).ok());
  ASSERT_TRUE(arbiter_.Override(kWearer, true, 1000 * kMs).ok());
  ASSERT_TRUE(arbiter_.Override(kWearer, false, 2000 * kMs).ok());
  EXPECT_EQ(Pilot(), "");
}

TEST_F(GazeArbiterTest, TheQueueIsBounded) {
  Acquire(kAnn, 0);
  absl::Status last;
  for (int i = 0; i < 40; ++i) {
    const std::string id = "q" + std::to_string(i);
    last = arbiter_.Acquire({{id, id}, false}, "", kMs).status();
  }
  EXPECT_EQ(last.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(arbiter_.queue(), SizeIs(16));
}

TEST_F(GazeArbiterTest, PauseStopsEverybodyWithoutTakingTheLease) {
  Acquire(kAnn, 0);
  EXPECT_EQ(arbiter_.Pause(kAnn, true).code(), absl::StatusCode::kPermissionDenied);
  ASSERT_TRUE(arbiter_.Pause(kWearer, true).ok());
  const absl::Status refused = arbiter_.MaySteer(kAnn, 100 * kMs);
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("paused"));
  ASSERT_TRUE(arbiter_.Pause(kWearer, false).ok());
  EXPECT_TRUE(arbiter_.MaySteer(kAnn, 200 * kMs).ok());
}

TEST_F(GazeArbiterTest, WhoWaitsSilentlyLosesHisPlace) {
  Acquire(kAnn, 0);
  Acquire(kBob, 0);
  for (Timestamp t = 0; t <= 6000 * kMs; t += 300 * kMs) Acquire(kAnn, t);
  EXPECT_THAT(arbiter_.queue(), SizeIs(0));
  EXPECT_EQ(arbiter_.Release(kBob, 6000 * kMs).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(GazeArbiterTest, NobodySteersWithoutALease) {
  const absl::Status refused = arbiter_.MaySteer(kAnn, 0);
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("acquire the lease"));
}

}  // namespace
}  // namespace saccade::gaze_arbiter_test
